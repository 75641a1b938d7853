// SPDX-License-Identifier: BSD-3-Clause
// Description of an unexplained residual: channel, size, and the coordinate that it follows.
#pragma once

#include <optional>

#include "../fit/joint_fit.h"
#include "backlash_diagnosis/identification/effects/effect_search.h"

namespace backlash::identification {

/// Of the channel that stays farthest above its floor; none where both are below `clear` times theirs or a
/// hundredth of the signal.
std::optional<Unexplained> signature(const Machine& machine, const RecordSet& records, double clear);

}  // namespace backlash::identification
