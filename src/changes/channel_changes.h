// SPDX-License-Identifier: BSD-3-Clause
// What is reported of one channel, be it of a joint or of the joints of an arm.
#pragma once

#include <string>
#include <vector>

#include "change_search.h"

namespace backlash::changes {

/// The changes of a channel, and what they leave: what no effect explains does not count as healthy.
/// `of_two`: two inertias.
Changes reported_changes(const ChangeSearch& search, const std::vector<FoundChange>& found, bool of_two,
                         bool linear, const ChangeSettings& settings);

/// What is over soon is no change of the machine, whatever it looks like: a push, or a fault that a few
/// passes show.
void take_out_short(const ChangeSettings& settings, Changes& out);

/// What the record has from its beginning on.
void add_different(const std::string& name, Changes& out);

}  // namespace backlash::changes
