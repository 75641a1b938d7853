// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/flank_windows.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "flank_hats.h"

namespace backlash::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd position_hats(const std::vector<double>& q, int most, double per_knot) {
  const double wanted = std::max(1.0, std::floor(double(q.size()) / per_knot));
  const int knots = static_cast<int>(std::min<double>(most, wanted));
  MatrixXd h = MatrixXd::Zero(static_cast<Eigen::Index>(q.size()), knots);
  const auto [low, high] = signal::extent(q);
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (knots == 1) {
      h(i, 0) = 1;
      continue;
    }
    const double x = (knots - 1) * (q[i] - low) / (high - low);
    const int k = std::clamp(static_cast<int>(x), 0, knots - 2);
    h(i, k) = 1 - (x - k);
    h(i, k + 1) = x - k;
  }
  return h;
}

std::vector<Eigen::Index> first_knots(const MatrixXd& h) {
  const Eigen::Index last = std::max<Eigen::Index>(0, h.cols() - 2);
  std::vector<Eigen::Index> first(static_cast<std::size_t>(h.rows()), last);
  for (Eigen::Index k = last; k >= 0; --k)
    for (Eigen::Index i = 0; i < h.rows(); ++i)
      if (h(i, k) != 0) first[static_cast<std::size_t>(i)] = k;
  return first;
}

FlankWindows average_windows(const TwoEncoders& motion, std::size_t half) {
  FlankWindows out;
  const std::size_t n = motion.motor.size();
  const double h = static_cast<double>(half), span = h * motion.interval;
  for (std::size_t c = half; c + half < n; c += half) {
    bool whole = true;
    double torque = 0, motor = 0, load = 0, least = INFINITY, largest = -INFINITY, rough = 0;
    const auto deflection = [&](std::size_t i) { return motion.motor[i] - motion.load[i]; };
    for (std::size_t i = c - half; i <= c + half; ++i) {
      const double weight = (h - std::abs(static_cast<double>(i) - static_cast<double>(c))) / (h * h);
      torque += weight * motion.torque[i];
      motor += weight * motion.motor[i];
      load += weight * motion.load[i];
      if (weight > 0) {
        least = std::min(least, deflection(i));
        largest = std::max(largest, deflection(i));
        rough += 0.25 * std::abs(deflection(i - 1) - 2 * deflection(i) + deflection(i + 1)) / (2 * h - 1);
      }
      whole = whole && (i == c - half || motion.unbroken[i]);
    }
    if (!whole) continue;
    // Mean speed over the triangle: difference of the means over its two halves (trapezoids).
    const auto speed = [&](const std::vector<double>& q) {
      double sum = 0;
      for (std::size_t i = 0; i < half; ++i)
        sum += 0.5 * (q[c + i] + q[c + i + 1] - q[c - half + i] - q[c - half + i + 1]);
      return sum / (h * span);
    };
    out.centre.push_back(c);
    out.torque.push_back(torque);
    out.deflection.push_back(motor - load);
    out.load.push_back(load);
    out.speed.push_back(speed(motion.motor));
    out.slip.push_back(out.speed.back() - speed(motion.load));
    const auto acceleration = [&](const std::vector<double>& q) {
      return (q[c + half] - 2 * q[c] + q[c - half]) / (span * span);
    };
    out.acceleration.push_back(acceleration(motion.motor));
    out.load_acceleration.push_back(acceleration(motion.load));
    out.least.push_back(least);
    out.largest.push_back(largest);
    out.rough.push_back(rough);
  }
  return out;
}

FlankWindows with_balanced_torque(FlankWindows windows) {
  const auto n = static_cast<Eigen::Index>(windows.size());
  if (windows.size() < 4 * kFewestOnFlank) return windows;
  const MatrixXd position = position_hats(windows.load, kCommonKnots, kWindowsPerKnot);
  MatrixXd a(n, position.cols() + 4);
  a.leftCols(position.cols()) = position;
  for (Eigen::Index i = 0; i < n; ++i)
    a.row(i).tail(4) << windows.acceleration[i], windows.load_acceleration[i], windows.speed[i],
        windows.speed[i] > 0 ? 1.0 : -1.0;
  // Scaled to unit length: the columns are of different units. A knot that no window lies near gets nothing.
  for (Eigen::Index k = 0; k < a.cols(); ++k) a.col(k) /= std::max(1e-300, a.col(k).norm());
  const VectorXd recorded = Eigen::Map<const VectorXd>(windows.torque.data(), n);
  Eigen::Map<VectorXd>(windows.torque.data(), n) = a * signal::solve_least_squares(a, recorded).x;
  return windows;
}

}  // namespace backlash::diagnosis
