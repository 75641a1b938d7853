// SPDX-License-Identifier: BSD-3-Clause
// Scores that the test draws from their definition: mean J d, covariance J, of three values that are
// estimated together. What is drawn is the truth.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "changes/rig_scan.h"

namespace backlash::changes {
namespace {

constexpr int kStretches = 24;
constexpr double kDuration = 240;  // s
constexpr double kNever = 1e-6;    // probability of a false alarm

/// A = L L^T, its lower triangle.
const Eigen::Matrix3d& root() {
  static const Eigen::Matrix3d l = (Eigen::Matrix3d() << 80, 0, 0, 60, 40, 0, -20, 30, 50).finished();
  return l;
}

HealthyRig rig() {
  HealthyRig rig;
  for (int i = 0; i < 3; ++i) {
    rig.values.push_back({"value", "m"});
    rig.effects.push_back({"value " + std::to_string(i), "m", Eigen::Vector3d::Unit(i), 1e-3, 1, i});
  }
  rig.mean = Eigen::Vector3d(0.3, -0.2, 0.1);
  rig.day = Eigen::Vector3d::Constant(0.02 * 0.02);
  return rig;
}

using Other = Eigen::Vector3d (*)(double t);

std::vector<FittedStretch> stretches(const HealthyRig& rig, unsigned seed, Other other) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<FittedStretch> all;
  for (int i = 0; i < kStretches; ++i) {
    FittedStretch s;
    s.at.from = kDuration * i / kStretches, s.at.to = s.at.from + 1;
    s.judged = true;
    s.information = root() * root().transpose();
    const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
    s.score = s.information * (rig.mean + other(s.at.middle())) + root() * noise;
    all.push_back(s);
  }
  return all;
}

Eigen::Vector3d nothing(double) {
  return Eigen::Vector3d::Zero();
}

TEST(RigScan, AStepHasItsNameTimeAndSize) {
  const ChangeSettings settings;
  const HealthyRig healthy = rig();
  const RigScan scan(healthy,
                     stretches(healthy, 1, [](double t) { return Eigen::Vector3d(0, t < 103 ? 0 : 0.1, 0); }),
                     kNever, settings);
  const auto found = scan.run().changes;
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].effect, 1u);
  EXPECT_FALSE(found[0].shape.ramp);
  const Stretch onset = scan.onset_interval(found[0], {});
  EXPECT_LE(onset.from, 103);
  EXPECT_GE(onset.to, 103);
  EXPECT_LT(onset.to - onset.from, 12);  // stretches are 10 s apart, and 1 s long
  EXPECT_NEAR(found[0].size, 0.1, 4 * std::sqrt(found[0].variance));
  // The one value explains it: by theory chi-square of two for the other two.
  EXPECT_LT(scan.all_gain(found[0].shape, {}) - found[0].gain, 25);
}

TEST(RigScan, GrowthFromAnOnset) {
  const ChangeSettings settings;
  const HealthyRig healthy = rig();
  const RigScan scan(healthy,
                     stretches(healthy, 2,
                               [](double t) {
                                 return Eigen::Vector3d(t < 80 ? 0 : 0.2 * (t - 80) / 151, 0,
                                                        0);  // 0.2 at the end
                               }),
                     kNever, settings);
  const auto found = scan.run().changes;
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].effect, 0u);
  EXPECT_TRUE(found[0].shape.ramp);
  EXPECT_NEAR(found[0].size, 0.2, 0.02);
  const Stretch onset = scan.onset_interval(found[0], {});
  EXPECT_LE(onset.from, 80);
  EXPECT_GE(onset.to, 80);
}

TEST(RigScan, WhatIsUndoneHasAnEnd) {
  const ChangeSettings settings;
  const HealthyRig healthy = rig();
  const auto undone = [](double t) { return Eigen::Vector3d(0, 0, t > 62 && t < 157 ? -0.15 : 0); };
  const RigScan scan(healthy, stretches(healthy, 3, undone), kNever, settings);
  const auto found = scan.run().changes;
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].effect, 2u);
  EXPECT_NEAR(found[0].shape.since, 62, 10);
  EXPECT_NEAR(found[0].shape.until, 157, 10);
}

TEST(RigScan, TwoValuesAtOnceLeaveWhatNoNameExplains) {
  const ChangeSettings settings;
  const HealthyRig healthy = rig();
  const auto both = [](double t) { return Eigen::Vector3d(t < 103 ? 0 : 0.1, t < 103 ? 0 : -0.1, 0); };
  const RigScan scan(healthy, stretches(healthy, 4, both), kNever, settings);
  const RigScan::Found found = scan.run();
  ASSERT_LE(found.changes.size(), 1u);  // a second one of the same event is not reported beside it
  if (found.changes.size() == 1) {
    EXPECT_GT(scan.all_gain(found.changes[0].shape, {}), 1.25 * found.changes[0].gain);
  } else {
    const auto unexplained = scan.unexplained(found);
    ASSERT_TRUE(unexplained);
    EXPECT_NEAR(unexplained->since, 103, 10);
  }
}

TEST(RigScan, OfTheWholeRecordIsNoChangeButADifference) {
  const ChangeSettings settings;
  const HealthyRig healthy = rig();
  const RigScan scan(healthy, stretches(healthy, 5, [](double) { return Eigen::Vector3d(0.3, 0, 0); }),
                     kNever, settings);
  const RigScan::Found found = scan.run();
  EXPECT_TRUE(found.changes.empty());
  ASSERT_EQ(found.different.size(), 1u);
  EXPECT_EQ(found.different[0].effect, 0u);
  EXPECT_FALSE(scan.unexplained(found));
}

/// 0.1 of 400 healthy records is 40; the bound of the threshold is the sum over effects and shapes, which are
/// reported together: not more, but for four standard deviations of the count.
TEST(RigScan, FalseAlarmsAreThoseThatAreAllowed) {
  const ChangeSettings settings;
  const HealthyRig healthy = rig();
  int wrong = 0;
  for (unsigned seed = 100; seed < 500; ++seed)
    wrong += !RigScan(healthy, stretches(healthy, seed, nothing), 0.1, settings).run().changes.empty();
  EXPECT_LE(wrong, 40 + 24);
  EXPECT_GE(wrong, 4);  // nor deaf
}

}  // namespace
}  // namespace backlash::changes
