// SPDX-License-Identifier: BSD-3-Clause
#include "motion_shape.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::geared_arm {
namespace {

constexpr Eigen::Index kGrid = 256;  // times per period; choice: 12 per cycle of the highest of 20 harmonics
constexpr double kInside =
    0.99;  // of half the range that the grid allows: the farthest offset from its middle; choice
constexpr double kApproachSpeed = 1.875;  // theory: largest slope of 10 x^3 - 15 x^4 + 6 x^5,
const double kApproachAcceleration = 10 / std::sqrt(3.0);  // and largest curvature
constexpr double kRounding = 1 - 1e-12;                    // of the limits

}  // namespace

MotionShaper::MotionShaper(const std::vector<MotionLimits>& limits, const PlanSettings& settings)
    : limits_(limits),
      period_(settings.period),
      between_(std::cos(M_PI * settings.harmonics / double(kGrid)) * kRounding),
      harmonics_(settings.harmonics),
      position_(kGrid, 2 * harmonics_),
      velocity_(kGrid, 2 * harmonics_),
      acceleration_(kGrid, 2 * harmonics_) {
  for (Eigen::Index i = 0; i < kGrid; ++i)
    for (Eigen::Index k = 1; k <= harmonics_; ++k) {
      const double w = 2 * M_PI * double(k) / period_, x = 2 * M_PI * double(k * i) / double(kGrid);
      const Eigen::Index a = k - 1, b = harmonics_ + k - 1;
      position_(i, a) = std::cos(x), position_(i, b) = std::sin(x);
      velocity_(i, a) = -w * std::sin(x), velocity_(i, b) = w * std::cos(x);
      acceleration_(i, a) = -w * w * std::cos(x), acceleration_(i, b) = -w * w * std::sin(x);
    }
}

/// Of the joint's coefficients, at most 1.
double MotionShaper::largest_scale(const Shape& shape, Eigen::Index joint) const {
  const MotionLimits& l = limits_[std::size_t(joint)];
  const Eigen::VectorXd c = shape.coefficients.col(joint), p = position_ * c;
  const double room = between_ * (l.upper - l.lower) / 2, middle = (l.lower + l.upper) / 2;
  const double above = middle + room - shape.offsets[joint], below = shape.offsets[joint] - middle + room;
  double scale = 1;
  for (const double each : p) {
    if (each > 0) scale = std::fmin(scale, above / each);
    if (each < 0) scale = std::fmin(scale, below / -each);
  }
  const double speed = (velocity_ * c).cwiseAbs().maxCoeff();
  const double acceleration = (acceleration_ * c).cwiseAbs().maxCoeff();
  if (speed > 0) scale = std::fmin(scale, between_ * l.speed / speed);
  if (acceleration > 0) scale = std::fmin(scale, between_ * l.acceleration / acceleration);
  return scale;
}

Shape MotionShaper::within_limits(Shape shape) const {
  const Eigen::VectorXd k = Eigen::VectorXd::LinSpaced(harmonics_, 1, double(harmonics_));
  const Eigen::VectorXd k2 = k.cwiseAbs2();
  for (Eigen::Index j = 0; j < shape.offsets.size(); ++j) {
    const MotionLimits& l = limits_[std::size_t(j)];
    const double middle = (l.lower + l.upper) / 2, room = kInside * between_ * (l.upper - l.lower) / 2;
    shape.offsets[j] = std::clamp(shape.offsets[j], middle - room, middle + room);
    auto cosines = shape.coefficients.col(j).head(harmonics_);
    auto sines = shape.coefficients.col(j).tail(harmonics_);
    cosines -= k2 * (k2.dot(cosines) / k2.squaredNorm());
    sines -= k * (k.dot(sines) / k.squaredNorm());
    shape.coefficients.col(j) *= room > 0 ? largest_scale(shape, j) : 0;
  }
  return shape;
}

JointMotions MotionShaper::motion(const Shape& shape) const {
  JointMotions m;
  m.q = signal::product(position_, shape.coefficients).rowwise() + shape.offsets.transpose();
  m.v = signal::product(velocity_, shape.coefficients);
  m.a = signal::product(acceleration_, shape.coefficients);
  return m;
}

std::vector<simulation::FourierMotion> MotionShaper::series(const Shape& shape) const {
  std::vector<simulation::FourierMotion> all;
  double approach = 0;
  for (Eigen::Index j = 0; j < shape.offsets.size(); ++j) {
    const MotionLimits& l = limits_[std::size_t(j)];
    const Eigen::VectorXd c = shape.coefficients.col(j);
    simulation::FourierMotion m;
    m.start = l.start;
    m.period = period_;
    m.offset = shape.offsets[j];
    m.cosines.assign(c.data(), c.data() + harmonics_);
    m.sines.assign(c.data() + harmonics_, c.data() + 2 * harmonics_);
    const double way = std::fabs(m.offset + c.head(harmonics_).sum() - m.start);
    approach = std::fmax(approach, std::fmax(kApproachSpeed * way / l.speed,
                                             std::sqrt(kApproachAcceleration * way / l.acceleration)));
    all.push_back(std::move(m));
  }
  for (simulation::FourierMotion& m : all) m.approach = std::ceil(10 * approach) / 10;
  return all;
}

}  // namespace backlash::geared_arm
