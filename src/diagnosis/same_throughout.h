// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace backlash::diagnosis {

/// `plays` [rad] of single passages of the gap in the order of time, whose median has an interval of half
/// this width. A play that steps or grows within the record is none that an interval could hold: throws
/// Refusal where the medians of what comes before and after one of the quarters of the passages are apart by
/// more than the interval is wide, a tenth of the larger and four of their errors.
void require_same_throughout(const std::vector<double>& plays, double half_width);

}  // namespace backlash::diagnosis
