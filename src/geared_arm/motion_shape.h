// SPDX-License-Identifier: BSD-3-Clause
// Fourier series of all joints at rest where a period begins, made as small as the limits ask.
//
// A trigonometric polynomial of degree n with |p| <= m at N > 2 n even times is nowhere larger than m /
// cos(pi n / N) (Ehlich and Zeller 1964, Math. Z. 86:41). So limits that hold at the grid with this factor
// hold between its times too.
#pragma once

#include <vector>

#include "backlash_diagnosis/geared_arm/motion_plan.h"
#include "base_information.h"

namespace backlash::geared_arm {

/// Of all joints: offsets [rad], and a_1 ... a_n, b_1 ... b_n [rad] as columns.
struct Shape {
  Eigen::VectorXd offsets;
  Eigen::MatrixXd coefficients;
};

class MotionShaper {
 public:
  MotionShaper(const std::vector<MotionLimits>& limits, const PlanSettings& settings);

  /// The nearest shape that is at rest where a period begins, each joint smaller where it is beyond its
  /// limits.
  Shape within_limits(Shape shape) const;

  /// Over one period, at `grid_size` even times.
  JointMotions motion(const Shape& shape) const;
  Eigen::Index grid_size() const { return position_.rows(); }

  /// From rest at the start, the approach as short as the limits allow, rounded up to 0.1 s.
  std::vector<simulation::FourierMotion> series(const Shape& shape) const;

 private:
  double largest_scale(const Shape& shape, Eigen::Index joint) const;

  const std::vector<MotionLimits>& limits_;
  double period_, between_;
  Eigen::Index harmonics_;
  Eigen::MatrixXd position_, velocity_, acceleration_;  // rows: times, columns: per coefficient
};

}  // namespace backlash::geared_arm
