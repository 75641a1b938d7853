// SPDX-License-Identifier: BSD-3-Clause
// What is tried of a whole arm before effects of single joints, and which of it is reported: a body that has
// come or is gone, gravity from another direction; and the gain of one motor, which a body can look like.
#pragma once

#include <string>
#include <vector>

#include "trace_evidence.h"

namespace backlash::arm {

/// Whether it is of a joint by itself.
bool of_joint(const Candidate& c);

/// In their order: a payload at the last link, come or gone, first; gains of single motors last.
std::vector<Candidate> chain_candidates(const ArmRig& rig);

/// The one to report of those that are believed; none: the end of the list.
std::size_t best_of(const std::vector<Candidate>& all, const ArmTraceSettings& settings);

/// A body at the last link that has come, or is gone, and does as well as the other of the two.
const Candidate* rival_of(const std::vector<Candidate>& all, std::size_t chosen,
                          const ArmTraceSettings& settings);

/// Names of effects of another kind that do nearly as well.
std::vector<std::string> as_good_as(const std::vector<Candidate>& all, std::size_t chosen,
                                    const ArmTraceSettings& settings);

}  // namespace backlash::arm
