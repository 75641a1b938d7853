// SPDX-License-Identifier: BSD-3-Clause
// Loads moved side by side against one moved alone in small steps by the library's pow().
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../src/diagnosis/traverse_motion.h"

namespace backlash::diagnosis {
namespace {

/// A motor to and fro over a gap, and two windows.
TraverseData some_data() {
  TraverseData d;
  d.interval = 2e-3, d.steps = 4, d.samples = 60;
  d.level = 300, d.slow = 2e-4;
  for (int i = 0; i < 400; ++i) {
    const double t = i * d.interval;
    d.position.push_back(0.4 + 0.03 * std::sin(21 * t) + 1e-3 * std::sin(170 * t));
    d.rate.push_back(0.03 * 21 * std::cos(21 * t) + 0.17 * std::cos(170 * t));
    d.acceleration.push_back(-0.03 * 441 * std::sin(21 * t) - 28.9 * std::sin(170 * t));
    d.torque.push_back(200 * std::sin(9 * t));
    d.counts.push_back(i % 11 != 0);
  }
  d.windows = {{20, 1, 250, -3e3}, {170, -1, -90, 1e4}};
  return d;
}

/// One of several that differ in every value; their powers lie below, at and above 1.
TraverseRun some_run(const TraverseData& data, int which) {
  TraverseRun run;
  run.window = &data.windows[static_cast<std::size_t>(which) % data.windows.size()];
  const double other = 1 + 0.07 * which;
  run.machine[kTraverseGap] = 4e-4 * other;
  run.machine[kTraverseStiffness] = 4e5 / other;
  run.machine[kTraverseDamping] = 450 * other;
  run.machine[kTraverseLoadInertia] = 90 * other;
  run.machine[kTraverseMotorInertia] = 7 / other;
  run.machine[kTraverseMotorDamping] = 12 * other;
  run.machine[kTraverseMotorFriction] = 50 / other;
  run.machine[kTraverseLoadFriction] = 15 * other;
  run.machine[kTraversePower] = 0.7 + 0.1 * which;
  run.machine[kTraverseEarlier] = 0.4 + 0.02 * which;
  run.own << 1e-5 * which, 2e-3 * (which - 4), 3.0 * which, -5.0 * which;
  return run;
}

constexpr int kSmallSteps = 1000;  // per sample

/// The equations of gap_traverse.h, run by run, by the library's pow(), in steps across touches: they are
/// told to half a small step.
class Reference {
 public:
  Reference(const TraverseData& data, const TraverseRun& run)
      : d_(data), first_(run.window->first), m_(run.machine), own_(run.own) {
    const double torque = std::fabs(run.window->torque);
    const double in = d_.level / m_[kTraverseStiffness] * std::pow(torque / d_.level, 1 / m_[kTraversePower]);
    q_ = d_.position[first_] - run.window->side * (0.5 * m_[kTraverseGap] + in) + own_[kOwnPosition];
    w_ = d_.rate[first_] - in * run.window->torque_rate / (m_[kTraversePower] * torque) + own_[kOwnRate];
  }

  /// Through the teeth about each sample but the last, N m.
  std::vector<double> teeth() {
    std::vector<double> mean(d_.samples, 0.0);
    const double h = d_.interval / kSmallSteps;
    for (std::size_t k = 0; k + 1 < d_.samples; ++k)
      for (int s = 0; s < kSmallSteps; ++s) {
        const double u = double(s) / kSmallSteps, half = u + 0.5 / kSmallSteps, end = u + 1.0 / kSmallSteps;
        const double here = torque(k, u, q_, w_);
        mean[k] += (1 - u) * here / kSmallSteps, mean[k + 1] += u * here / kSmallSteps;
        const double w1 = w_, a1 = acceleration(here, w1);
        const double w2 = w_ + h / 2 * a1, a2 = acceleration(torque(k, half, q_ + h / 2 * w1, w2), w2);
        const double w3 = w_ + h / 2 * a2, a3 = acceleration(torque(k, half, q_ + h / 2 * w2, w3), w3);
        const double w4 = w_ + h * a3, a4 = acceleration(torque(k, end, q_ + h * w3, w4), w4);
        q_ += h / 6 * (w1 + 2 * w2 + 2 * w3 + w4), w_ += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
      }
    return mean;
  }

 private:
  double torque(std::size_t k, double u, double q, double w) const {
    const std::size_t i = first_ + k;
    const double q0 = d_.position[i], q1 = d_.position[i + 1], v0 = d_.rate[i] * d_.interval,
                 v1 = d_.rate[i + 1] * d_.interval;
    const double motor = q0 + u * (v0 + u * (3 * (q1 - q0) - 2 * v0 - v1 + u * (2 * (q0 - q1) + v0 + v1)));
    const double rate =
        (v0 + u * (2 * (3 * (q1 - q0) - 2 * v0 - v1) + 3 * u * (2 * (q0 - q1) + v0 + v1))) / d_.interval;
    const double side = motor > q ? 1 : -1, in = side * (motor - q) - 0.5 * m_[kTraverseGap];
    if (in <= 0) return 0;
    const double power = m_[kTraversePower], pressed = m_[kTraverseStiffness] * in / d_.level;
    const double damping = m_[kTraverseDamping] * (power > 1 ? std::pow(pressed, 3 * (power - 1)) : 1);
    return side * std::max(0.0, d_.level * std::pow(pressed, power) + damping * side * (rate - w));
  }

  double acceleration(double teeth, double w) const {
    const double friction = m_[kTraverseLoadFriction] * std::clamp(w / d_.slow, -1.0, 1.0);
    return (teeth - own_[kOwnLoadTorque] - friction) / m_[kTraverseLoadInertia];
  }

  const TraverseData& d_;
  std::size_t first_;
  TraverseMachine m_;
  TraverseOwn own_;
  double q_ = 0, w_ = 0;
};

/// Largest difference of the torque from the reference's over the usual torque, of all runs.
double error_of(int steps, const std::vector<std::vector<double>>& expected) {
  TraverseData data = some_data();
  data.steps = steps;
  std::vector<TraverseRun> runs;
  for (std::size_t i = 0; i < expected.size(); ++i) runs.push_back(some_run(data, int(i)));
  const Eigen::MatrixXd teeth = traverse_teeth(data, runs);
  double worst = 0;
  for (std::size_t i = 0; i < expected.size(); ++i)
    for (Eigen::Index k = 0; k + 1 < teeth.rows(); ++k)
      worst = std::max(worst, std::fabs(teeth(k, Eigen::Index(i)) - expected[i][std::size_t(k)]));
  return worst / data.level;
}

// The reference is off by half a small step at each touch of damped teeth: 4e-4 of the level here. A stage
// across the end of friction's ramp, 2e-4 rad/s, is off by more.
TEST(TraverseMotion, IsThatOfTheEquations) {
  const TraverseData data = some_data();
  std::vector<std::vector<double>> expected;
  for (int i = 0; i < 11; ++i) {
    expected.push_back(Reference(data, some_run(data, i)).teeth());
    const auto pressed = [&](double torque) { return std::fabs(torque) > 0.1 * data.level; };
    EXPECT_GT(std::count_if(expected[i].begin(), expected[i].end(), pressed), 10) << i;
    EXPECT_FALSE(std::all_of(expected[i].begin(), expected[i].end() - 1, pressed)) << i;
  }
  EXPECT_LT(error_of(1, expected), 0.03);
  EXPECT_LT(error_of(2, expected), 0.01);
  EXPECT_LT(error_of(4, expected), 0.003);
}

TEST(TraverseMotion, OneAloneIsTheSameAsBesideOthers) {
  const TraverseData data = some_data();
  std::vector<TraverseRun> runs;
  for (int i = 0; i < kTraverseRuns; ++i) runs.push_back(some_run(data, i));
  const Eigen::MatrixXd together = traverse_teeth(data, runs);
  for (int i = 0; i < kTraverseRuns; ++i) {
    const Eigen::MatrixXd alone = traverse_teeth(data, {runs[static_cast<std::size_t>(i)]});
    EXPECT_EQ(alone, together.col(i)) << i;
  }
}

TEST(TraverseMotion, WhatDoesNotMoveTheLoadCountsInWhatIsLeftAlone) {
  const TraverseData data = some_data();
  for (int value = 0; value < kTraverseValues + kTraverseOwn; ++value) {
    const TraverseRun run = some_run(data, 5);
    TraverseRun moved = run;
    double& changed =
        value < kTraverseValues ? moved.machine[std::size_t(value)] : moved.own[value - kTraverseValues];
    changed *= 1.1;
    const Eigen::MatrixXd teeth = traverse_teeth(data, {run, moved});
    EXPECT_EQ(teeth.col(0) != teeth.col(1), moves_load(value)) << value;
    EXPECT_NE(traverse_residual(data, run, teeth.col(0)), traverse_residual(data, moved, teeth.col(1)))
        << value;
  }
}

TEST(TraverseMotion, WhatIsLeftIsTheTorqueLessWhatTheMachineNeeds) {
  const TraverseData data = some_data();
  const TraverseRun run = some_run(data, 3);
  const TraverseMachine& m = run.machine;
  const Eigen::VectorXd teeth = Eigen::VectorXd::LinSpaced(Eigen::Index(data.samples), -200, 300);
  const Eigen::VectorXd left = traverse_residual(data, run, teeth);
  for (Eigen::Index k = 0; k < teeth.size(); ++k) {
    const std::size_t i = run.window->first + std::size_t(k);
    const bool counts = k > 0 && k + 1 < teeth.size() && data.counts[i];
    const double drive = data.torque[i] + m[kTraverseEarlier] * (data.torque[i - 1] - data.torque[i]) -
                         run.own[kOwnMotorTorque];
    const double motor = m[kTraverseMotorInertia] * data.acceleration[i] +
                         m[kTraverseMotorDamping] * data.rate[i] +
                         m[kTraverseMotorFriction] * (data.rate[i] > 0 ? 1 : -1);
    EXPECT_NEAR(left[k], counts ? drive - motor - teeth[k] : 0, 1e-9) << k;
  }
}

}  // namespace
}  // namespace backlash::diagnosis
