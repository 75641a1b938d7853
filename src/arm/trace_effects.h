// SPDX-License-Identifier: BSD-3-Clause
// Effects of single joints in a trace of an arm, one after the other, as long as the part of the test record
// that was not fitted confirms them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "trace_evidence.h"

namespace backlash::arm {

struct JointEffectsFound {
  std::vector<Candidate> steps;  // one for each effect, with those before it
  std::vector<ArmTrace::Rejected> rejected;
  /// By joint: effects that do nearly as well as all its friction by a factor.
  std::map<std::size_t, std::vector<std::string>> friction_alike;
};

/// Beside `model`. Where an effect of all records does as well as one of the test record alone, it is of all.
/// Where friction of a joint is not that of the training, effects that rub are tried instead of the factor.
JointEffectsFound joint_effects(const Candidate& model, const CandidateFits& fits, const Motions& fitted,
                                const Motions& judged);

}  // namespace backlash::arm
