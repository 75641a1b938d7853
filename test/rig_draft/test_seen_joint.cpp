// SPDX-License-Identifier: BSD-3-Clause
// What a record shows of its machine: motions whose torque is written down here in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_draft/seen_joint.h"

namespace backlash::rig_draft {
namespace {

using record::Channel;

/// q = sum of two sines, so that inertia, weight and friction are distinguished; tau = J a + d w + C sign(w)
/// + G sin(q + p).
struct Machine {
  double inertia = 0.8, viscous = 2.5, coulomb = 1.4, weight = 0, phase = 0;
};

record::CheckedRecord moving(const Machine& m, double duration = 30, double play = 0, double ratio = 1) {
  record::Record r;
  r.name = "test";
  constexpr double kRate = 500;
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.05);  // N m
  for (int i = 0; i < int(duration * kRate); ++i) {
    const double t = i / kRate, u = 2.1 * t, v = 5.3 * t;
    const double q = 0.9 * std::sin(u) + 0.25 * std::sin(v + 0.4);
    const double w = 0.9 * 2.1 * std::cos(u) + 0.25 * 5.3 * std::cos(v + 0.4);
    const double a = -0.9 * 2.1 * 2.1 * std::sin(u) - 0.25 * 5.3 * 5.3 * std::sin(v + 0.4);
    r.time.push_back(t);
    r.column(Channel::motor_position).push_back(ratio * q);
    r.column(Channel::motor_torque)
        .push_back(m.inertia * a + m.viscous * w + std::copysign(m.coulomb, w) +
                   m.weight * std::sin(q + m.phase) + noise(random));
    if (play > 0) r.column(Channel::load_position).push_back(q - std::copysign(0.5 * play, w));
  }
  return record::check_record(r);
}

// Tolerances: the low-pass at 20 Hz rounds the steps of dry friction at reversals, which is a few percent of
// it.

TEST(SeenJoint, InertiaAndFrictionAreThoseOfTheTorque) {
  const SeenJoint seen = look_at_joint(moving({}));
  ASSERT_TRUE(seen.torque);
  EXPECT_NEAR(seen.torque->inertia.value, 0.8, 0.02);
  EXPECT_NEAR(seen.torque->viscous.value, 2.5, 0.1);
  EXPECT_NEAR(seen.torque->coulomb.value, 1.4, 0.1);
  EXPECT_GT(seen.torque->explained, 0.98);
  EXPECT_FALSE(seen.torque->weight);
  EXPECT_FALSE(seen.torque->reversed);
  EXPECT_NEAR(seen.rate, 500, 1e-6);
  EXPECT_FALSE(seen.load);
}

TEST(SeenJoint, WeightIsDistinguishedFromInertiaWhereTheJointTravelsFar) {
  const SeenJoint seen = look_at_joint(moving({0.8, 2.5, 1.4, 12, 0.6}));
  ASSERT_TRUE(seen.torque && seen.torque->weight);
  EXPECT_NEAR(seen.torque->weight->value, 12, 0.3);
  EXPECT_NEAR(seen.torque->phase, 0.6, 0.03);
  EXPECT_NEAR(seen.torque->inertia.value, 0.8, 0.04);
}

TEST(SeenJoint, MeanTorqueIsAWeightWhereTheJointHardlyTravels) {
  record::CheckedRecord checked = moving({});
  for (double& q : checked.record.column(Channel::motor_position)) q = 0.8 + 0.1 * q;
  for (double& t : checked.record.column(Channel::motor_torque)) t = 9 + t;
  const SeenJoint seen = look_at_joint(checked);
  ASSERT_TRUE(seen.torque && seen.torque->weight);
  EXPECT_NEAR(seen.torque->weight->value * std::sin(0.8 + seen.torque->phase), 9, 0.2);
}

TEST(SeenJoint, TorqueOfTheOtherSignIsTurned) {
  record::CheckedRecord checked = moving({});
  for (double& t : checked.record.column(Channel::motor_torque)) t = -t;
  const SeenJoint seen = look_at_joint(checked);
  ASSERT_TRUE(seen.torque);
  EXPECT_TRUE(seen.torque->reversed);
  EXPECT_NEAR(seen.torque->inertia.value, 0.8, 0.02);
}

TEST(SeenJoint, EffortThatDoesNotFollowTheMotionIsNoTorque) {
  record::CheckedRecord checked = moving({});
  std::mt19937 random(2);
  std::normal_distribution<double> noise(40, 1);  // a temperature
  for (double& t : checked.record.column(Channel::motor_torque)) t = noise(random);
  const SeenJoint seen = look_at_joint(checked);
  ASSERT_TRUE(seen.torque);
  EXPECT_LT(seen.torque->explained, kTakesTorque);
}

TEST(SeenJoint, RatioAndLoosenessAreThoseOfTheTwoEncoders) {
  for (const double ratio : {1.0, 50.0, -50.0}) {
    const SeenJoint seen = look_at_joint(moving({}, 30, 2e-3, ratio));
    ASSERT_TRUE(seen.load) << ratio;
    EXPECT_NEAR(seen.load->motor_turns, ratio,
                1e-3 * std::abs(ratio));  // the play takes a share of the travel
    EXPECT_NEAR(seen.load->looseness, 2e-3, 2e-4);
  }
}

TEST(SeenJoint, WhatShowsNothingIsRefusedWithTheReason) {
  EXPECT_THROW(look_at_joint(moving({}, 3)), BadData);
  record::CheckedRecord still = moving({});
  for (double& q : still.record.column(Channel::motor_position)) q = 1;
  EXPECT_THROW(look_at_joint(still), BadData);
  record::CheckedRecord none = moving({});
  none.record.column(Channel::motor_position).clear();
  EXPECT_THROW(look_at_joint(none), BadData);
}

}  // namespace
}  // namespace backlash::rig_draft
