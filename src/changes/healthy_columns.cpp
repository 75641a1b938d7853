// SPDX-License-Identifier: BSD-3-Clause
#include "healthy_columns.h"

#include <cmath>

namespace backlash::changes {

Eigen::MatrixXd beside(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd out(a.rows(), a.cols() + b.cols());
  out << a, b;
  return out;
}

std::vector<OfMoment> lasting(const MotionSampling& sampling) {
  std::vector<OfMoment> all(kCommonColumns);
  all[kInertia] = [](const Moment& m) { return m.acceleration; };
  all[kViscous] = [](const Moment& m) { return m.speed; };
  all[kCoulomb] = [](const Moment& m) { return m.direction; };
  all[kOffset] = [](const Moment&) { return 1; };
  all[kCosine] = [](const Moment& m) { return std::cos(m.position); };
  all[kSine] = [](const Moment& m) { return std::sin(m.position); };
  all[kJerk] = [](const Moment& m) { return m.jerk; };
  if (sampling.channel == ChangeChannel::torque) return all;
  if (sampling.chain) all[kInertia] = [](const Moment& m) { return m.chain; };
  all.emplace_back([](const Moment& m) { return m.side(); });    // kHalfGap
  all.emplace_back([](const Moment& m) { return m.position; });  // kScale
  return all;
}

std::vector<OfMoment> warming(const MotionSampling& sampling, double warm_up) {
  if (sampling.channel == ChangeChannel::deflection) return {};
  return {[=](const Moment& m) { return m.speed * std::exp(-m.time / warm_up); },
          [=](const Moment& m) { return m.direction * std::exp(-m.time / warm_up); }};
}

Eigen::MatrixXd base_columns(const SampledMotion& motion, double warm_up) {
  return beside(columns(motion, lasting(motion.sampling)),
                columns(motion, warming(motion.sampling, warm_up)));
}

}  // namespace backlash::changes
