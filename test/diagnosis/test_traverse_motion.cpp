// SPDX-License-Identifier: BSD-3-Clause
// Loads moved side by side against one moved alone in small steps by the library's pow().
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../src/diagnosis/traverse_windows.h"

namespace backlash::diagnosis {
namespace {

/// A motor to and fro over a gap, and two windows.
TraverseData some_data() {
  TraverseData d;
  d.interval = 2e-3, d.steps = 4, d.samples = 60;
  d.level = 3000, d.slow = 2e-4;
  for (int i = 0; i < 400; ++i) {
    const double t = i * d.interval;
    d.position.push_back(0.4 + 0.03 * std::sin(21 * t) + 1e-3 * std::sin(170 * t));
    d.rate.push_back(0.03 * 21 * std::cos(21 * t) + 0.17 * std::cos(170 * t));
    d.acceleration.push_back(-0.03 * 441 * std::sin(21 * t) - 28.9 * std::sin(170 * t));
    d.torque.push_back(200 * std::sin(9 * t));
    d.counts.push_back(i % 11 != 0);
  }
  d.windows.resize(2);
  d.windows[0].first = 20, d.windows[0].side = 1, d.windows[0].torque = 250, d.windows[0].torque_rate = -3e3;
  d.windows[1].first = 170, d.windows[1].side = -1, d.windows[1].torque = -90, d.windows[1].torque_rate = 1e4;
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
  run.machine[kTraverseLoadDamping] = 8 * other;
  run.machine[kTraverseHardening] = 0.01 * which;
  run.machine[kTraverseDampingPower] = 0.05 * which;
  run.machine[kTraverseLate] = 0.4 + 0.2 * which;
  run.own << 1e-5 * which, 2e-3 * (which - 4), 3.0 * which, -5.0 * which, 0;
  return run;
}

constexpr int kSmallSteps = 1000;  // per sample

/// The equations of gap_traverse.h, run by run, by the library's pow(), in steps across touches: they are
/// known to half a small step.
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
    const double pressed = std::min(m_[kTraverseStiffness] * in / d_.level, 10.0), h = m_[kTraverseHardening];
    const double spring = m_[kTraverseStiffness] * in * std::pow(pressed, m_[kTraversePower] - 1) *
                          (1 + h * pressed * pressed) / (1 + h);
    const double damping = m_[kTraverseDamping] * std::pow(pressed, m_[kTraverseDampingPower]);
    return side * std::max(0.0, spring + damping * side * (rate - w));
  }

  double acceleration(double teeth, double w) const {
    const double friction = m_[kTraverseLoadFriction] * std::clamp(w / d_.slow, -1.0, 1.0);
    return (teeth - own_[kOwnLoadTorque] - m_[kTraverseLoadDamping] * w - friction) /
           m_[kTraverseLoadInertia];
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
  const Eigen::MatrixXd teeth = traverse_motion(data, runs).teeth;
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
  EXPECT_LT(error_of(1, expected), 0.05);
  EXPECT_LT(error_of(2, expected), 0.01);
  EXPECT_LT(error_of(4, expected), 0.003);
}

// Damped teeth push at once where they touch, by a power of a deflection that only rounding leaves there. The
// motion follows a value by a line on 1e-9 of it: what bends is less than a thousandth of what moves.
TEST(TraverseMotion, FollowsItsValuesSmoothly) {
  const TraverseData data = some_data();
  for (const double power : {0.01, 0.1, 0.7}) {
    std::vector<TraverseRun> runs;
    for (int i = -1; i <= 1; ++i) {
      runs.push_back(some_run(data, 3));
      runs.back().machine[kTraverseDampingPower] = power;
      runs.back().machine[kTraverseGap] *= 1 + 1e-9 * i;
    }
    const Eigen::MatrixXd rate = traverse_motion(data, runs).rate;
    const double moved = (rate.col(2) - rate.col(0)).cwiseAbs().maxCoeff(),
                 bent = (rate.col(2) - 2 * rate.col(1) + rate.col(0)).cwiseAbs().maxCoeff();
    EXPECT_LT(bent, 1e-3 * moved) << power;
  }
}

TEST(TraverseMotion, OneAloneIsTheSameAsBesideOthers) {
  const TraverseData data = some_data();
  std::vector<TraverseRun> runs;
  for (int i = 0; i < kTraverseRuns; ++i) runs.push_back(some_run(data, i));
  const TraverseMotion together = traverse_motion(data, runs);
  for (int i = 0; i < kTraverseRuns; ++i) {
    const TraverseMotion alone = traverse_motion(data, {runs[static_cast<std::size_t>(i)]});
    EXPECT_EQ(alone.teeth, together.teeth.col(i)) << i;
    EXPECT_EQ(alone.position, together.position.col(i)) << i;
  }
}

GapTraverseSettings some_settings() {
  GapTraverseSettings s;
  s.motor_inertia = 7, s.load_inertia = 90, s.motor_damping = 12, s.motor_friction = 50, s.load_friction = 15;
  s.flank.stiffness = 4e5, s.flank.damping = 450, s.gap = 4e-4;
  return s;
}

// Columns that share a motion are those for which it is the same: each alone gives what it gives beside
// others, and each value that is not known changes what is left.
TEST(TraverseWindows, ColumnsAreThoseOfEachAlone) {
  for (const bool by_load : {false, true}) {
    TraverseData data = some_data();
    data.torque_noise = 2, data.position_noise = 1e-7, data.width = 1e-3, data.load_noise = 1e-6,
    data.shown_spread = 5e-5;
    if (by_load) {
      data.load = data.position, data.load_counts.assign(data.load.size(), 1);
      for (const double q : data.position)
        data.sine.push_back(std::sin(q)), data.cosine.push_back(std::cos(q));
      for (TraverseWindow& w : data.windows)
        w.load = data.position[w.first], w.load_rate = data.rate[w.first];
    }
    const TraverseWindows windows(data, some_settings(), data.windows);
    const Eigen::Index n = kTraverseValues, m = kTraverseOwn;
    Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(n, 1 + n + m), own = Eigen::MatrixXd::Zero(m, 1 + n + m);
    for (Eigen::Index k = 0; k < n; ++k) shared(k, 1 + k) = 0.3;
    for (Eigen::Index k = 0; k < m; ++k) own(k, 1 + n + k) = 0.3;
    const Eigen::MatrixXd all = windows.residuals(0, shared, own);
    for (Eigen::Index c = 0; c < all.cols(); ++c) {
      EXPECT_EQ(windows.residuals(0, shared.col(c), own.col(c)), all.col(c)) << c;
      if (c == 0) continue;
      const fit::Prior& prior =
          c <= n ? windows.shared()[std::size_t(c - 1)] : windows.own()[std::size_t(c - 1 - n)];
      EXPECT_EQ(all.col(c) != all.col(0), prior.spread > 0) << prior.name << " " << by_load;
    }
  }
}

// Hertz's teeth after Hunt and Crossley, declared at the level of the record. A commissioning that left
// nothing holds their law; one that left 0.0327 of a deflection, as lines leave of Hertz's teeth, knows no
// more than none.
TEST(TraverseWindows, ALawIsHeldAsFarAsItWasTried) {
  const TraverseData data = some_data();
  GapTraverseSettings s = some_settings();
  s.flank.power = 1.5, s.flank.damping_power = 1.5;
  const auto prior = [&](double unexplained, int value) {
    s.unexplained = unexplained;
    return TraverseWindows(data, s, data.windows).shared()[std::size_t(value)];
  };
  const double deflection = data.level / s.flank.stiffness;
  for (const int value : {kTraversePower, kTraverseDampingPower}) {
    EXPECT_DOUBLE_EQ(prior(0, value).value(0), 1.5);
    EXPECT_EQ(prior(0, value).spread, 0);
    EXPECT_EQ(prior(0.0327 * deflection, value).value(0), prior(kNaN, value).value(0));
    EXPECT_EQ(prior(0.0327 * deflection, value).spread, prior(kNaN, value).spread);
    const double little = prior(0.0327 * deflection / 30, value).spread;
    EXPECT_GT(little, 0);
    EXPECT_LT(little, 0.1 * prior(kNaN, value).spread);
  }
  EXPECT_EQ(prior(0, kTraverseHardening).value(0), 0);
  EXPECT_GT(prior(kNaN, kTraverseHardening).value(0), 0);
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
    // 1.0 samples late: that of the sample before.
    const double drive = data.torque[i - 1] - run.own[kOwnMotorTorque];
    const double motor = m[kTraverseMotorInertia] * data.acceleration[i] +
                         m[kTraverseMotorDamping] * data.rate[i] +
                         m[kTraverseMotorFriction] * (data.rate[i] > 0 ? 1 : -1);
    EXPECT_NEAR(left[k], counts ? drive - motor - teeth[k] : 0, 1e-9) << k;
  }
}

}  // namespace
}  // namespace backlash::diagnosis
