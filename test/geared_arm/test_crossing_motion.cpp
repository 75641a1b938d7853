// SPDX-License-Identifier: BSD-3-Clause
// Two links that their motors move through gaps, against small steps that know of no touch.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../src/geared_arm/crossing_fit.h"

namespace backlash::geared_arm {
namespace {

constexpr int kSmallSteps = 2000;  // per sample

CrossingData some_data() {
  CrossingData d;
  d.interval = 1e-3, d.friction_speed = 0.01;
  for (int j = 0; j < 2; ++j) {
    TraverseJoint joint;
    joint.stiffness = 2e4 / (1 + j), joint.damping = 12, joint.level = 15, joint.rotor = 0.1;
    joint.link_viscous = 0.05;
    d.joints.push_back(joint);
  }
  constexpr Eigen::Index kSamples = 160;
  CrossingWindow w;
  w.position = w.rate = w.bias = Eigen::MatrixXd(kSamples, 2);
  for (Eigen::Index i = 0; i < kSamples; ++i)
    for (Eigen::Index j = 0; j < 2; ++j) {
      const double t = double(i) * d.interval, f = 40.0 + 15.0 * double(j);
      w.position(i, j) = 0.02 * std::cos(f * t), w.rate(i, j) = -0.02 * f * std::sin(f * t);
      w.bias(i, j) = 2 * std::cos(9 * t);  // N m, gravity
    }
  w.inertia.assign(kSamples, (Eigen::Matrix2d() << 0.5, 0.1, 0.1, 0.2).finished());
  w.load = Eigen::Vector2d(-16, -10);
  d.windows = {w};
  return d;
}

/// Of powers of 1: teeth are springs with a damper, and never pull.
CrossingMachine some_machine() {
  CrossingMachine m(2);
  for (auto& joint : m) {
    joint.fill(0);
    for (const int factor : {kCrossingStiffness, kCrossingDamping, kCrossingPower, kCrossingRotor})
      joint[std::size_t(factor)] = 1;
  }
  m[0][kCrossingGap] = 2e-3, m[1][kCrossingGap] = 3e-3;
  m[0][kCrossingCoulomb] = 0.3;
  return m;
}

/// Euler's method, positions by new speeds; the motors on the cubics through their samples.
Eigen::MatrixXd by_small_steps(const CrossingData& d, const CrossingMachine& m) {
  const CrossingWindow& w = d.windows[0];
  const Eigen::Matrix2d mobility = w.inertia[0].inverse();
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(w.samples() - 1, 2);
  const double h = d.interval / kSmallSteps;
  Eigen::Vector2d q, v = w.rate.row(0);
  for (int j = 0; j < 2; ++j)
    q[j] = w.position(0, j) -
           std::copysign(m[j][kCrossingGap] / 2 + std::fabs(w.load[j]) / d.joints[j].stiffness, w.load[j]);
  for (Eigen::Index i = 0; i + 1 < w.samples(); ++i)
    for (int s = 0; s < kSmallSteps; ++s) {
      const double u = (s + 0.5) / kSmallSteps;
      Eigen::Vector2d net;
      for (int j = 0; j < 2; ++j) {
        const double q0 = w.position(i, j), step = w.position(i + 1, j) - q0, v0 = w.rate(i, j) * d.interval,
                     v1 = w.rate(i + 1, j) * d.interval, second = 3 * step - 2 * v0 - v1,
                     third = v0 + v1 - 2 * step;
        const double x = q0 + u * (v0 + u * (second + u * third)) - q[j],
                     rate = (v0 + u * (2 * second + 3 * u * third)) / d.interval - v[j];
        const double side = x > 0 ? 1 : -1, in = side * x - m[j][kCrossingGap] / 2;
        const double teeth =
            in > 0 ? side * std::fmax(0, d.joints[j].stiffness * in + d.joints[j].damping * side * rate) : 0;
        mean(i, j) += teeth / kSmallSteps;
        net[j] = teeth - (1 - u) * w.bias(i, j) - u * w.bias(i + 1, j) - d.joints[j].link_viscous * v[j] -
                 m[j][kCrossingCoulomb] * std::tanh(v[j] / d.friction_speed);
      }
      v += h * mobility * net, q += h * v;
    }
  return mean;
}

double error_of(int steps, const Eigen::MatrixXd& expected) {
  CrossingData data = some_data();
  data.steps = steps;
  const CrossingWindow& window = data.windows[0];
  const Eigen::MatrixXd mean = mesh_torques(data, window, link_mobilities(data, window, some_machine()),
                                            some_machine(), Eigen::VectorXd::Zero(2 * kCrossingOwn));
  return (mean - expected).cwiseAbs().maxCoeff() / data.joints[0].level;
}

// One step per sample is 0.3 rad of the faster teeth's cycle. The reference is off by half a small step at
// each touch of damped teeth: 1e-4 of the level. Steps across touches were off by 7 and 3 %.
TEST(CrossingMotion, IsThatOfTheEquations) {
  const CrossingData data = some_data();
  const Eigen::MatrixXd expected = by_small_steps(data, some_machine());
  for (int j = 0; j < 2; ++j) {
    EXPECT_GT((expected.col(j).array() > 5).count(), 20) << j;  // both flanks, and none
    EXPECT_GT((expected.col(j).array() < -5).count(), 20) << j;
    EXPECT_GT((expected.col(j).array() == 0).count(), 5) << j;
  }
  EXPECT_LT(error_of(1, expected), 0.003);
  EXPECT_LT(error_of(2, expected), 0.0005);
}

// A gap that all turns share and one of a turn alone are one number to its teeth. Sums that differ in their
// last bits let a touch more or less decide that one turn knows the common gap better than its own leaves.
TEST(CrossingWindows, AStepOfTheGapIsOneOfTheTurn) {
  CrossingData data = some_data();
  CrossingWindow& window = data.windows[0];
  window.torque = window.friction = window.unsure = Eigen::MatrixXd::Zero(window.samples(), 2);
  for (TraverseJoint& joint : data.joints)
    joint.most = 30, joint.least_inertia = 0.2, joint.torque_noise = 0.1, joint.position_noise = 1e-6;
  CrossingWindows windows(data);
  windows.vary_about(some_machine());
  Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(2 * kCrossingValues, 3),
                  own = Eigen::MatrixXd::Zero(2 * kCrossingOwn, 3);
  const fit::Prior &gap = windows.shared()[kCrossingGap], &wider = windows.own()[2];
  shared.row(kCrossingGap).setConstant(2e-3 / gap.spread);
  shared(kCrossingGap, 1) += gap.step;
  own(2, 2) += wider.step;
  const Eigen::MatrixXd left = windows.residuals(0, shared, own);
  ASSERT_TRUE(left.allFinite());
  EXPECT_GT((left.col(1) - left.col(0)).norm(), 0);
  EXPECT_EQ(left.col(1), left.col(2));
}

}  // namespace
}  // namespace backlash::geared_arm
