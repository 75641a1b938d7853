// SPDX-License-Identifier: BSD-3-Clause
// What all channels share, be they of a joint or of the joints of an arm: what is reported of what the
// effects that are tried leave.
#pragma once

#include <string>
#include <vector>

#include "change_search.h"

namespace backlash::changes {

/// "37 s"
std::string whole_seconds(double time);

/// What no effect explains does not count as healthy. `of_two`: two inertias.
void report_unexplained(const ChangeSearch& search, const std::vector<FoundChange>& found, bool of_two,
                        const ChangeSettings& settings, Changes& out);

/// What is over soon is no change of the machine, whatever it looks like: a push, or a fault that a few
/// passes show.
void take_out_short(const ChangeSettings& settings, Changes& out);

}  // namespace backlash::changes
