// SPDX-License-Identifier: BSD-3-Clause
// The modes of one body under dry friction, and how a gear train keeps them.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/stick_slip.h"

namespace backlash::model {
namespace {

const FrictionLimits kLimits{3, 2};  // N m

StickSlip begun(double net, double& speed, const FrictionLimits& limits = kLimits) {
  StickSlip mode;
  mode.begin(net, speed, limits);
  return mode;
}

TEST(StickSlip, AtRestItSticksUpToTheLimitsAndSlidesAboveThem) {
  const struct {
    double net;
    int direction;
  } cases[] = {{0, 0}, {2.999, 0}, {3, 0}, {3.001, 1}, {-1.999, 0}, {-2, 0}, {-2.001, -1}};
  for (const auto& c : cases) {
    double speed = 0;
    const StickSlip mode = begun(c.net, speed);
    EXPECT_EQ(mode.direction(), c.direction) << c.net;
    EXPECT_EQ(mode.stuck(), c.direction == 0);
    EXPECT_EQ(mode.torque(kLimits), c.direction == 0 ? 0 : c.direction > 0 ? -3 : 2) << c.net;
  }
}

TEST(StickSlip, ItsSpeedDecidesWhereItMoves) {
  for (double net : {-9.0, 0.0, 9.0})
    for (double speed : {-1e-300, -2.0, 1e-300, 2.0}) {
      double kept = speed;
      EXPECT_EQ(begun(net, kept).direction(), speed > 0 ? 1 : -1);
      EXPECT_EQ(kept, speed);
    }
}

TEST(StickSlip, BehindTheZeroOfItsSpeedItSticksOrTurnsRound) {
  for (int sign : {1, -1}) {
    double speed = sign * 0.5;
    StickSlip mode = begun(0, speed);
    EXPECT_FALSE(mode.update(-sign * 9, speed, kLimits)) << "still on its way";
    speed = -sign * 1e-18;
    StickSlip turning = mode;
    EXPECT_TRUE(mode.update(-sign * 1.5, speed, kLimits));
    EXPECT_EQ(speed, 0);
    EXPECT_TRUE(mode.stuck());
    EXPECT_FALSE(mode.update(-sign * 1.5, speed, kLimits));
    EXPECT_TRUE(mode.update(sign * 4, speed, kLimits)) << "a jump of the torque breaks it away";
    EXPECT_EQ(mode.direction(), sign);
    speed = -sign * 1e-18;
    EXPECT_TRUE(turning.update(-sign * 4, speed, kLimits));
    EXPECT_EQ(turning.direction(), -sign);
    EXPECT_EQ(speed, 0);
  }
}

// What an integrator looks for: below zero throughout the mode, above behind its end, and never zero, which
// would be no event if the integrator started there.
TEST(StickSlip, TheEventRisesThroughZeroWhereTheModeEnds) {
  double speed = 0;
  const StickSlip stuck = begun(0, speed), forward = begun(4, speed), backward = begun(-4, speed);
  EXPECT_LT(stuck.event(2.9, 0, kLimits), 0);
  EXPECT_GT(stuck.event(3.1, 0, kLimits), 0);
  EXPECT_LT(stuck.event(-1.9, 0, kLimits), 0);
  EXPECT_LT(stuck.event(3, 0, kLimits), 0);
  EXPECT_LT(stuck.event(-2, 0, kLimits), 0);
  EXPECT_GT(stuck.event(-2.1, 0, kLimits), 0);
  for (double net : {-9.0, 0.0, 9.0}) {
    EXPECT_LT(forward.event(net, 0.1, kLimits), 0);
    EXPECT_LT(forward.event(net, 0, kLimits), 0);
    EXPECT_GT(forward.event(net, -1e-300, kLimits), 0);
    EXPECT_LT(backward.event(net, -0.1, kLimits), 0);
    EXPECT_LT(backward.event(net, 0, kLimits), 0);
    EXPECT_GT(backward.event(net, 1e-300, kLimits), 0);
  }
}

TEST(StickSlip, AnImpactSetsInMotionWhatSticksButNotWhatIsHeld) {
  double speed = 0;
  StickSlip mode = begun(0, speed);
  speed = -0.3;
  EXPECT_TRUE(mode.update(0, speed, kLimits));
  EXPECT_EQ(mode.direction(), -1);
  EXPECT_EQ(speed, -0.3);
  const double never = std::numeric_limits<double>::infinity();
  speed = 0.7;
  StickSlip held = begun(1e300, speed, {never, never});
  EXPECT_TRUE(held.stuck());
  EXPECT_EQ(speed, 0);
  speed = -0.7;
  EXPECT_TRUE(held.update(0, speed, {never, never}));
  EXPECT_TRUE(held.stuck());
  EXPECT_EQ(speed, 0);
}

TEST(StickSlip, WithoutFrictionItHoldsNothing) {
  double speed = 0;
  for (double net : {-1e-300, 0.0, 1e-300}) {
    const StickSlip mode = begun(net, speed, {0, 0});
    EXPECT_EQ(mode.stuck(), net == 0);
    EXPECT_EQ(mode.torque({0, 0}), 0);
  }
}

Rig two_inertias() {
  Rig rig;
  rig.motor = {2, 0.3, 0.1, 5, 1};  // forward 0.4 and 6, backward 0.2 and 4
  rig.link = {3, 0.7, -0.2, 2, -0.5};
  rig.mesh.backlash = 1;
  rig.mesh.contact = make_contact_law("linear", {{"stiffness", 100}, {"damping", 0}});
  return rig;
}

TEST(StickSlip, TheTrainSlowsEachEndByItsFrictionOfThatDirection) {
  GearTrain train(two_inertias());
  ASSERT_EQ(train.friction_event_count(), 2);
  const double torque = 1.5;
  for (double motor : {0.8, -0.8})
    for (double load : {0.6, -0.6}) {
      double state[] = {0.1, 0, motor, load}, rate[4];
      train.begin_friction(0, state, {torque, -0.25});
      train.derivative(0, state, {torque, -0.25}, rate);
      const double of_motor = motor > 0 ? 0.4 * 0.8 + 6 : -0.2 * 0.8 - 4;
      const double of_load = load > 0 ? 0.5 * 0.6 + 1.5 : -0.9 * 0.6 - 2.5;
      EXPECT_DOUBLE_EQ(rate[2], (torque - of_motor) / 2);
      EXPECT_DOUBLE_EQ(rate[3], (-0.25 - of_load) / 3);
    }
}

TEST(StickSlip, AStuckEndHasNoRateWhateverTheSolverMakesOfItsState) {
  GearTrain train(two_inertias());
  double state[] = {0.1, 0.2, 0, 0.6}, rate[4];
  train.begin_friction(0, state, 5.9);
  EXPECT_TRUE(train.any_stuck());
  state[0] += 1e-15, state[2] = 1e-19, state[3] = 0.55;
  train.hold(state);
  EXPECT_EQ(state[0], 0.1);
  EXPECT_EQ(state[2], 0);
  EXPECT_EQ(state[3], 0.55) << "it moves";
  train.derivative(0, state, 5.9, rate);
  EXPECT_EQ(rate[0], 0);
  EXPECT_EQ(rate[2], 0);
  EXPECT_EQ(rate[1], 0.55);
  EXPECT_TRUE(([&] { return train.update_friction(0, state, 6.1); })()) << "above the limit of 6";
  train.derivative(0, state, 6.1, rate);
  EXPECT_NEAR(rate[2], 0.05, 1e-15);  // rounding of (6.1 - 6) / 2
}

TEST(StickSlip, OnlyEndsThatRubAndMoveAreWatched) {
  Rig rig = two_inertias();
  rig.link_locked = true;
  EXPECT_EQ(GearTrain(rig).friction_event_count(), 1);
  rig.motor.coulomb_friction = rig.motor.coulomb_asymmetry = 0;
  GearTrain free(rig);
  EXPECT_EQ(free.friction_event_count(), 0);
  EXPECT_FALSE(free.any_stuck());
  double state[] = {0, 0};
  EXPECT_FALSE(free.update_friction(0, state, 1));
  free.brake_motor();
  EXPECT_EQ(free.friction_event_count(), 1);
  free.brake_motor();
  EXPECT_EQ(free.friction_event_count(), 1);
}

// Motor friction that the file states at the motor shaft acts on the load side times the ratio.
TEST(StickSlip, OnTheMotorSideTheRatioCounts) {
  Rig rig = two_inertias();
  rig.reduction_ratio = 10;
  rig.motor_side = true;
  GearTrain train(rig);
  double state[] = {0, 0, 0, 0};
  for (double torque : {5.99, 6.01, -3.99, -4.01}) {  // N m at the motor
    train.begin_friction(0, state, torque);
    double rate[4];
    train.derivative(0, state, torque, rate);
    const double moved = torque > 6 ? torque - 6 : torque < -4 ? torque + 4 : 0;
    EXPECT_NEAR(rate[2], 10 * moved / (100 * 2), 1e-14) << torque;  // load side: n T / (n^2 J)
  }
  double moving[] = {0, 0, 0.5, 0}, rate[4];  // 5 rad/s at the motor
  train.begin_friction(0, moving, 0.0);
  train.derivative(0, moving, 0.0, rate);
  EXPECT_DOUBLE_EQ(rate[2], -(6 + 0.4 * 5) / 2 / 10);
}

}  // namespace
}  // namespace backlash::model
