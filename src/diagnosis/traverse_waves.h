// SPDX-License-Identifier: BSD-3-Clause
// Waves over a turn of the motor in what is left of its torque: cogging, a first stage that runs out.
#pragma once

#include <vector>

namespace backlash::diagnosis {

/// Orders per turn, at most `most`, the largest first: as far as they are more than noise would show of so
/// many orders. `angle`: of the motor at each value of `left`, rad.
std::vector<double> wave_orders(std::vector<double> left, const std::vector<double>& angle, int most);

}  // namespace backlash::diagnosis
