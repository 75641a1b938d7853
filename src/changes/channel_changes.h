// SPDX-License-Identifier: BSD-3-Clause
// What all channels share, be they of a joint or of the joints of an arm: which effects are tried, and what
// is told of what they leave.
#pragma once

#include <vector>

#include "change_search.h"

namespace backlash::changes {

std::vector<ScannedEffect> candidates_of(const HealthyModel& model,
                                         const std::vector<record::Record>& healthy,
                                         const ChangeSettings& settings);

/// What no effect explains is no health. `of_two`: inertias.
void tell_unexplained(const ChangeSearch& search, const std::vector<FoundChange>& found, bool of_two,
                      const ChangeSettings& settings, Changes& out);

/// What is over soon is no change of the machine, whatever it looks like: a push, or a fault that few passes
/// show.
void take_out_short(const ChangeSettings& settings, Changes& out);

}  // namespace backlash::changes
