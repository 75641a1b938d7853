// SPDX-License-Identifier: BSD-3-Clause
// Speed control of the motor, torque on the load and the motor brake.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

const double kNever = std::numeric_limits<double>::infinity();
const SpeedController kController = {1000, 2000, 7000, 2475};

/// A motor that no tooth reaches.
model::Rig motor_alone() {
  model::Rig rig =
      test::wall_rig(1, 1e6, model::make_contact_law("linear", {{"stiffness", 1}, {"damping", 0}}));
  rig.motor.inertia = 6.3;
  return rig;
}

ExcitationSettings speeds(std::vector<double> speeds, double hold, double ramp,
                          const SpeedController& controller = kController) {
  ExcitationSettings settings;
  settings.type = "constant_speed";
  settings.controller = controller;
  settings.speeds = std::move(speeds);
  settings.hold = hold;
  settings.ramp = ramp;
  return settings;
}

/// What a controller with P = 1 and I = 0 asks for from a motor at rest: the reference.
double reference(Excitation& excitation, long sample) {
  excitation.begin_segment(sample, model::Observation{});
  return excitation.torque(0, sample);
}

TEST(SpeedLoop, HoldsSpeedsOneAfterTheOther) {
  const auto loop = constant_speed_excitation({100, 1, 0, 1e3}, {2, -1}, 3, 1);
  const double step = 4;  // s, ramp and hold
  double before = 0;
  for (long k = 0; k < 2000; ++k) {
    const double t = k / 100.0, value = reference(*loop, k), s = std::fmod(t, step);
    EXPECT_EQ(loop->segment_end(k), (k + 1) / 100.0);
    const double to = static_cast<long>(t / step) % 2 == 0 ? 2 : -1;
    const double from = t < step ? 0 : 1 - to;  // the other one
    if (s >= 1) {
      EXPECT_EQ(value, to) << t;
    }
    if (s == 0.5) {
      EXPECT_DOUBLE_EQ(value, 0.5 * (from + to)) << t;
    }
    EXPECT_LE(std::fabs(value - before), 1.5 * 3 / 100 + 1e-12) << t;  // steepest slope: 1.5 / ramp
    before = value;
  }
}

TEST(SpeedLoop, SineSpeedHasItsOffsetAndFadesIn) {
  const auto loop = sine_speed_excitation({200, 1, 0, 1e3}, 0.8, 0.5, 2, 1);
  for (long k = 0; k < 1000; ++k) {
    const double t = k / 200.0, sine = 0.8 + 0.5 * std::sin(4 * M_PI * t), value = reference(*loop, k);
    if (t >= 1)
      EXPECT_DOUBLE_EQ(value, sine);
    else
      EXPECT_NEAR(value, sine * t * t * (3 - 2 * t), 1e-15);
  }
  EXPECT_EQ(loop->period(), 0);
}

TEST(SpeedLoop, TorqueIsProportionalPlusSumAndSampledOncePerSegment) {
  const auto loop = constant_speed_excitation({10, 3, 5, 1e3}, {1}, kNever, 1e-9);
  model::Observation machine{};
  reference(*loop, 0);  // the reference is 0 at time 0
  for (long k = 1; k < 20; ++k) {
    machine.motor_velocity = 0.75;
    for (int repeat = 0; repeat < 3; ++repeat) loop->begin_segment(k, machine);
    EXPECT_NEAR(loop->torque(123, k), 3 * 0.25 + 5 * 0.25 * k / 10, 1e-12) << k;
  }
}

// Friction lines of the driver alone (Table 5.2): at constant speed the motor overcomes friction only.
TEST(SpeedLoop, ReachesItsSpeedsAndThenNeedsTheFrictionLine) {
  model::Rig rig = motor_alone();
  rig.motor.viscous_damping = 0.5 * (13.7 + 11.5);
  rig.motor.viscous_asymmetry = 0.5 * (13.7 - 11.5);
  rig.motor.coulomb_friction = 0.5 * (63.0 + 62.7);
  rig.motor.coulomb_asymmetry = 0.5 * (63.0 - 62.7);
  Plant plant(rig, speeds({0.5, 1.5, -0.2}, 5, 1), test::solver(1e-8));
  const double lines[][2] = {
      {0.5, 63 + 13.7 * 0.5}, {1.5, 63 + 13.7 * 1.5}, {-0.2, -62.7 - 11.5 * 0.2}, {0.5, 63 + 13.7 * 0.5}};
  for (int k = 0; k < 4; ++k) {
    plant.advance_to(6 * (k + 1) - 1e-3);
    // slow pole of the loop: I / P = 3.5 1/s, e^(-3.5 * 5) of some 100 N m is 3e-6 N m
    EXPECT_NEAR(plant.observe().motor_velocity, lines[k][0], 1e-6) << k;
    EXPECT_NEAR(plant.motor_torque(), lines[k][1], 1e-4) << k;
  }
}

// Without friction a held torque changes the speed by u T / J exactly: a recursion of two numbers.
TEST(SpeedLoop, FollowsTheDifferenceEquationOfASampledLoop) {
  const SpeedController c = {50, 100, 400, 1e9};
  Plant plant(motor_alone(), speeds({2}, kNever, 1e-9, c), test::solver(1e-10));
  double speed = 0, sum = 0;
  for (int k = 0; k < 200; ++k) {
    plant.advance_to(k / 50.0);
    EXPECT_NEAR(plant.observe().motor_velocity, speed, 1e-8) << k;  // tolerance of the integrator
    const double error = (k == 0 ? 0 : 2) - speed;
    sum += error / 50;
    const double torque = 100 * error + 400 * sum;
    EXPECT_NEAR(plant.motor_torque(), torque, 1e-5) << k;
    plant.advance_to((k + 0.7) / 50.0);
    EXPECT_NEAR(plant.motor_torque(), torque, 1e-5) << "is held";
    speed += torque / 6.3 / 50;
  }
}

TEST(SpeedLoop, LimitedTorqueDoesNotWindUp) {
  const SpeedController c = {100, 60, 60, 0.63};  // 0.1 rad/s^2: 10 s to the speed
  Plant plant(motor_alone(), speeds({1}, kNever, 0.01, c), test::solver(1e-8));
  double fastest = 0, largest = 0;
  for (int k = 0; k < 3000; ++k) {
    plant.advance_to(k / 100.0);
    fastest = std::max(fastest, plant.observe().motor_velocity);
    largest = std::max(largest, std::fabs(plant.motor_torque()));
  }
  EXPECT_EQ(largest, 0.63);
  // The limit lets go where P e = 0.63, 0.0105 rad/s below; from there the loop cannot pass the speed by
  // more. Wound up, the sum of 10 s has 300 N m to take back.
  EXPECT_LT(fastest, 1 + 0.0105);
  EXPECT_NEAR(plant.observe().motor_velocity, 1, 1e-4);
}

TEST(SpeedLoop, WorksInTheUnitsOfTheMotorShaft) {
  model::Rig rig = motor_alone();
  rig.motor_side = true;
  rig.reduction_ratio = 4;
  Plant plant(rig, speeds({2}, kNever, 0.1), test::solver(1e-8));
  plant.advance_to(10);
  EXPECT_NEAR(plant.observe().motor_velocity, 2, 1e-6);
  EXPECT_NEAR(plant.state()[1], 0.5, 1e-6);  // load side
}

TEST(SpeedLoop, AResetAndAChangeBetweenSamplesLeaveTheLoopAsItWas) {
  const SpeedController slow = {20, 100, 400, 1e9};
  Plant plant(motor_alone(), speeds({2}, kNever, 0.5, slow), test::solver(1e-10));
  std::vector<double> first;
  for (int k = 0; k < 40; ++k) {
    plant.advance_to(k / 40.0);
    first.push_back(plant.motor_torque());
  }
  plant.reset();
  for (int k = 0; k < 40; ++k) {
    plant.advance_to(k / 40.0);
    EXPECT_NEAR(plant.motor_torque(), first[k], 1e-6) << k;  // tolerance of the integrator
    plant.set_backlash(plant.gear_train().backlash());
  }
}

TEST(SpeedLoop, RefusesWhatHasNoMeaning) {
  const SpeedController c = kController;
  EXPECT_THROW(constant_speed_excitation(c, {}, 1, 1), InvalidParameter);
  EXPECT_THROW(constant_speed_excitation(c, {std::nan("")}, 1, 1), InvalidParameter);
  EXPECT_THROW(constant_speed_excitation(c, {1}, 0, 1), InvalidParameter);
  EXPECT_THROW(constant_speed_excitation(c, {1}, 1, 0), InvalidParameter);
  EXPECT_THROW(sine_speed_excitation(c, 1, 1, 0, 1), InvalidParameter);
  EXPECT_THROW(sine_speed_excitation(c, 1, 1, 1, 0), InvalidParameter);
  for (const SpeedController bad : {SpeedController{0, 1, 1, 1}, SpeedController{1, -1, 1, 1},
                                    SpeedController{1, 1, -1, 1}, SpeedController{1, 1, 1, 0}})
    EXPECT_THROW(constant_speed_excitation(bad, {1}, 1, 1), InvalidParameter);
}

/// Two bodies, angular mesh: lever 1.
model::Rig two_bodies(double backlash, double stiffness, double start) {
  model::Rig rig;
  rig.motor.inertia = 6;
  rig.motor.coulomb_friction = 1;
  rig.link.inertia = 40;
  rig.link.viscous_damping = 2000;
  rig.mesh.backlash = backlash;
  rig.mesh.start_in_gap = start;
  rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", stiffness}, {"damping", 100}});
  return rig;
}

// At rest the spring carries the torque: the load travels by the gap and twice the deflection.
TEST(TorqueAtTheLoad, MovesTheLoadThroughTheGapWhileTheMotorIsBraked) {
  ExcitationSettings hand = test::square(50, 0.1);
  hand.at_load = hand.motor_brake = true;
  const double gap = 5e-4, stiffness = 4e5, start = 0.3;
  Plant plant(two_bodies(gap, stiffness, start), hand, test::solver(1e-8));
  const double middle = 0.5 * gap * start, reach = 0.5 * gap + 50 / stiffness;
  for (int half = 1; half <= 4; ++half) {
    plant.advance_to(5 * half - 0.01);
    const model::Observation o = plant.observe();
    EXPECT_EQ(o.motor_position, 0);
    EXPECT_EQ(o.motor_velocity, 0);
    EXPECT_EQ(o.motor_torque, 0);
    // time constant damping / stiffness = 5 ms, 1000 of them; tolerances of the integrator are 1e-12 rad
    EXPECT_NEAR(o.load_position, middle + (half % 2 == 1 ? reach : -reach), 1e-9) << half;
  }
}

TEST(TorqueAtTheLoad, DrivesTheMotorWhereItIsNotBraked) {
  ExcitationSettings hand = test::constant(50);
  hand.at_load = true;
  Plant plant(two_bodies(5e-4, 4e5, 0), hand, test::solver(1e-8));
  plant.advance_to(5);
  EXPECT_GT(plant.observe().motor_velocity, 0.02);  // (50 - 1) / 2000 rad/s, friction of the motor taken off
  EXPECT_LT(plant.observe().motor_velocity, 0.025);
}

TEST(TorqueAtTheLoad, IsRefusedForALockedLink) {
  ExcitationSettings hand = test::constant(50);
  hand.at_load = true;
  EXPECT_THROW(Plant(motor_alone(), hand, test::solver(1e-6)), InvalidParameter);
}

// The teeth never touch: the motor runs freely and the load stays where it is, exactly.
TEST(WithoutLoad, TheDriverIsAlone) {
  model::Rig rig = model::without_load(two_bodies(1e-4, 4e5, 0.9));
  rig.motor.viscous_damping = 10;
  Plant plant(rig, test::constant(6), test::solver(1e-8));
  for (int k = 1; k <= 20; ++k) {
    plant.advance_to(0.1 * k);
    const model::Observation o = plant.observe();
    EXPECT_NEAR(o.motor_velocity, 0.5 * (1 - std::exp(-10 * 0.1 * k / 6)),
                1e-7);  // (6 - 1) / 10 rad/s, J / c
    EXPECT_EQ(o.load_position, 0);
    EXPECT_EQ(o.load_velocity, 0);
  }
}

}  // namespace
}  // namespace backlash::simulation
