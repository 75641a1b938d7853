// SPDX-License-Identifier: BSD-3-Clause
// Values of strengths and shapes that the search for missing effects tries, of several terms.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "backlash_diagnosis/model/term.h"

namespace backlash::model {

/// Of a declared weight: a torque constant is not known better, and shows as more or less weight. Choice.
constexpr double kUsualOfWeight = 0.05;

/// Large compared with a torque noise of 1 %, small compared with the torque that moves the machine.
inline double clear_torque(const MotionRange& range) {
  return 0.05 * range.torque;
}

inline double clear_angle(const MotionRange& range) {
  return 0.1 * range.deflection;
}

/// Orders that the travel does not resolve, where a spectrum says little: whole numbers up to three periods
/// in the travel, or as many steps of a quarter of a period.
inline std::vector<double> low_orders(const MotionRange& range) {
  const double resolution = order_resolution(range), step = std::max(1.0, std::floor(0.25 * resolution));
  std::vector<double> all = {step};
  while (std::isfinite(resolution) && all.back() + step <= 3 * resolution) all.push_back(all.back() + step);
  return all;
}

/// The order of an effect that is periodic in a position.
inline TermShape order_shape(const WaveOver& wave) {
  return {"order", low_orders, true, wave};
}

}  // namespace backlash::model
