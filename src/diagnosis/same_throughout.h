// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace backlash::diagnosis {

/// `plays` [rad] of single passages of the gap in the order of time, whose median has an interval of half
/// this width. A play that steps or grows within the record is not one value with an interval. Throws Refusal
/// if at a quarter, half or three quarters of the passages the medians before and after differ by more than
/// the width of the interval, a tenth of the larger median, and four of their standard errors.
void require_same_throughout(const std::vector<double>& plays, double half_width);

}  // namespace backlash::diagnosis
