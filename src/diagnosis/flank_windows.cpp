// SPDX-License-Identifier: BSD-3-Clause
#include "flank_windows.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {

Hats position_hats(const std::vector<double>& q, int most, double per_knot) {
  Hats hats;
  const auto [low, high] = signal::extent(q);
  hats.count = static_cast<int>(std::min<double>(most, std::floor(double(q.size()) / per_knot)));
  if (hats.count < 3 || !(high > low)) return {};
  for (const double value : q) {
    const double x = (hats.count - 1) * (value - low) / (high - low);
    hats.first.push_back(std::clamp(static_cast<int>(x), 0, hats.count - 2));
    hats.share.push_back(x - hats.first.back());
  }
  return hats;
}

FlankWindows average_windows(const TwoEncoders& motion, std::size_t half) {
  FlankWindows out;
  out.half = half;
  const std::size_t n = motion.motor.size();
  const double h = static_cast<double>(half), span = h * motion.interval;
  for (std::size_t c = half; c + half < n; c += half) {
    bool whole = true;
    double torque = 0, motor = 0, load = 0, least = INFINITY, largest = -INFINITY, rough = 0;
    const auto deflection = [&](std::size_t i) { return motion.motor[i] - motion.load[i]; };
    for (std::size_t i = c - half; i <= c + half; ++i) {
      const double weight = (h - std::abs(static_cast<double>(i) - static_cast<double>(c))) / (h * h);
      torque += weight * motion.torque[i], motor += weight * motion.motor[i], load += weight * motion.load[i];
      if (weight > 0) {
        least = std::min(least, deflection(i)), largest = std::max(largest, deflection(i));
        rough += 0.25 * std::abs(deflection(i - 1) - 2 * deflection(i) + deflection(i + 1)) / (2 * h - 1);
      }
      whole = whole && motion.recorded[i];
    }
    if (!whole) continue;
    // Mean speed over the triangle: difference of the means over its two halves (trapezoids).
    const auto speed = [&](const std::vector<double>& q) {
      double sum = 0;
      for (std::size_t i = 0; i < half; ++i)
        sum += 0.5 * (q[c + i] + q[c + i + 1] - q[c - half + i] - q[c - half + i + 1]);
      return sum / (h * span);
    };
    const auto acceleration = [&](const std::vector<double>& q) {
      return (q[c + half] - 2 * q[c] + q[c - half]) / (span * span);
    };
    out.centre.push_back(c);
    out.torque.push_back(torque);
    out.deflection.push_back(motor - load);
    out.motor.push_back(motor), out.load.push_back(load);
    out.speed.push_back(speed(motion.motor)), out.load_speed.push_back(speed(motion.load));
    out.acceleration.push_back(acceleration(motion.motor));
    out.load_acceleration.push_back(acceleration(motion.load));
    out.range.push_back(largest - least), out.rough.push_back(rough);
  }
  return out;
}

}  // namespace backlash::diagnosis
