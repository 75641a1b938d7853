// SPDX-License-Identifier: BSD-3-Clause
// Two gears that stand on one flank under a torque and then on the other without: distances in closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/position_difference.h"

namespace backlash::diagnosis {
namespace {

constexpr double kPlay = 0.018, kCompliance = 1e-3, kTorque = 3, kNoise = 1e-4;  // rad, rad/(N m), N m, rad

/// Holds of 4 s: +3 N m, then 0 after the motor has run through the gap, and so on; 100 Hz.
record::Record holds(double play, int times, double turned = 1) {
  Random random(3);
  record::Record r;
  for (int k = 0; k < 400 * times; ++k) {
    const bool pressed = (k / 400) % 2 == 0;
    const double into = std::min(1.0, (k % 400) / 10.0);  // 0.1 s to get there
    const double load = 0.15 * (pressed ? into : 1 - into) * turned;
    const double on = pressed ? kCompliance * kTorque + 0.5 * play : -0.5 * play;
    r.time.push_back(0.01 * k);
    r.column(record::Channel::motor_torque)
        .push_back((pressed ? kTorque * turned : 0) + 0.05 * random.normal());
    r.column(record::Channel::load_position).push_back(load + kNoise * random.normal());
    r.column(record::Channel::motor_position).push_back(load + turned * on + kNoise * random.normal());
  }
  return r;
}

PositionDifferenceSettings settings() {
  PositionDifferenceSettings s;
  s.elastic_deflection = [](double torque) { return kCompliance * torque; };
  s.elastic_uncertainty = 0.4;
  s.motor_inertia = 0.01;
  return s;
}

TEST(RestLevels, ShowTheDistanceUnderTorqueAndTheFreePlayApart) {
  for (const double turned : {1.0, -1.0}) {
    const Estimate e = estimate_position_difference(holds(kPlay, 2, turned), settings());
    ASSERT_EQ(e.status, Status::ok) << e.message;
    const double apart = kPlay + kCompliance * kTorque;
    EXPECT_NEAR(e.backlash_angle, apart, 3 * kNoise / std::sqrt(10.0)) << "means over ten samples";
    EXPECT_LT(e.angle_lower, apart);
    EXPECT_GT(e.angle_upper, apart);
    EXPECT_LT(e.angle_upper - e.angle_lower, 0.1 * apart);
    ASSERT_TRUE(e.components);
    EXPECT_NEAR(e.components->gap, kPlay, kNoise);
    EXPECT_NEAR(e.components->at_torque, kTorque, 0.05);
    EXPECT_NEAR(e.deflection, 1.4 * kCompliance * kTorque, 0.05 * kCompliance * kTorque);
  }
}

TEST(RestLevels, WhatTheTeethAloneMayYieldIsNoPlay) {
  const Estimate e = estimate_position_difference(holds(0, 2), settings());
  EXPECT_NE(e.status, Status::ok) << e.message;
}

TEST(RestLevels, NothingIsReadOfOneTorque) {
  const Estimate e = estimate_position_difference(holds(kPlay, 1), settings());
  EXPECT_NE(e.status, Status::ok) << e.message;
}

}  // namespace
}  // namespace backlash::diagnosis
