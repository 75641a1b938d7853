// SPDX-License-Identifier: BSD-3-Clause
// Effects of single joints in a trace of an arm, one after the other, as long as the part of the test record
// that was not fitted confirms them.
#pragma once

#include <vector>

#include "trace_evidence.h"

namespace backlash::arm {

/// Beside `model`: one candidate for each effect, with those before it. Where an effect of all records does
/// as well as one of the test record alone, it is of all. What is not believed goes to `rejected`.
std::vector<Candidate> joint_effects(const Candidate& model, const CandidateFits& fits, const Motions& fitted,
                                     const Motions& judged, std::vector<ArmTrace::Rejected>& rejected);

}  // namespace backlash::arm
