// SPDX-License-Identifier: BSD-3-Clause
// The massless gear before a shaft, against its balance in closed form for linear teeth.
#include <gtest/gtest.h>

#include <cmath>

#include "../../src/simulation/lanes.h"
// Beyond the lanes.
#include "../../src/simulation/geared_shaft.h"

namespace backlash::simulation {
namespace {

constexpr double kTeeth = 4e4, kShaft = 9e4, kHalfGap = 5e-4, kFriction = 1.5;  // N m/rad, rad, N m
constexpr GearedShaft<double> kOnShaft{kShaft};

/// N m, with the motor there and the gear here.
double through_teeth(double motor, double gear) {
  const double twist = motor - gear, deep = std::fabs(twist) - kHalfGap;
  return deep > 0 ? std::copysign(kTeeth * deep, twist) : 0;
}

Gear<double> moved(const Gear<double>& before, double motor, double link) {
  double asked = 0;
  const Gear<double> gear = kOnShaft.follow(before, link, [&](double at) {
    asked = at;
    return OnGear<double>{through_teeth(motor, at), kFriction, kFriction};
  });
  EXPECT_EQ(asked, gear.position) << "was asked last elsewhere";
  return gear;
}

/// N m, of the bearing.
double rubs(double motor, double gear, double link) {
  return through_teeth(motor, gear) - kShaft * (gear - link);
}

TEST(GearedShaft, StandsWhileTheBearingHoldsIt) {
  const Gear<double> gear = moved({}, kHalfGap + 0.9 * kFriction / kTeeth, 0);
  EXPECT_EQ(gear.position, 0);
  EXPECT_EQ(gear.slides, 0);
}

TEST(GearedShaft, PressedItGoesWhereFrictionIsAtItsLimit) {
  for (const double way : {1.0, -1.0}) {
    const double motor = way * 2e-3;
    const Gear<double> gear = moved({}, motor, 0);
    // k_t (q_M - s / 2 - q) - k q = F
    EXPECT_NEAR(gear.position, way * (kTeeth * (2e-3 - kHalfGap) - kFriction) / (kTeeth + kShaft), 1e-9);
    EXPECT_EQ(gear.slides, way);
    EXPECT_NEAR(gear.slope, kTeeth + kShaft, 1e-3 * kShaft);
    EXPECT_NEAR(rubs(motor, gear.position, 0), way * kFriction, 1e-4);
  }
}

TEST(GearedShaft, InTheGapTheLinkTakesItAlong) {
  const Gear<double> gear = moved({}, 1e-4, 3e-4);
  EXPECT_NEAR(gear.position, 3e-4 - kFriction / kShaft, 1e-9);
  EXPECT_EQ(gear.slides, 1);
}

TEST(GearedShaft, ThroughTheWholeGapToTheOtherFlank) {
  const Gear<double> gear = moved({2e-3, 1, kTeeth + kShaft}, -2e-3, 0);
  EXPECT_NEAR(gear.position, (kTeeth * (-2e-3 + kHalfGap) + kFriction) / (kTeeth + kShaft), 1e-9);
  EXPECT_EQ(gear.slides, -1);
}

// A play operator knows no rate: in many steps or in one it comes to the same place, and each reversal takes
// 2 F of the torque before it moves.
TEST(GearedShaft, ManyStepsAreAsOne) {
  Gear<double> gear;
  for (int k = 1; k <= 1000; ++k) gear = moved(gear, 3e-6 * k, 0);
  EXPECT_NEAR(gear.position, moved({}, 3e-3, 0).position, 1e-9);
  const double before = gear.position;
  const double holds = 2 * kFriction / kTeeth;  // rad of the motor
  gear = moved(gear, 3e-3 - 0.99 * holds, 0);
  EXPECT_EQ(gear.position, before);
  gear = moved(gear, 3e-3 - 1.01 * holds, 0);
  EXPECT_LT(gear.position, before);
}

}  // namespace
}  // namespace backlash::simulation
