// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "support/rigs.h"

namespace backlash::model {
namespace {

using State = std::array<double, GearTrain::kMaxStates>;

Coupling flexible(double stiffness, double damping, double inertia) {
  return {false, stiffness, damping, inertia};
}

// Four moving parts, every parameter different from zero.
Rig full_rig() {
  Rig rig;
  rig.motor = {2e-5, 0.004};
  rig.pinion = {3e-5, 0.001};
  rig.gear = {5e-5, 0.002};
  rig.link = {7e-4, 0.003};
  rig.input_coupling = flexible(28, 0.01, 4e-6);
  rig.output_coupling = flexible(6000, 0.05, 6e-6);
  rig.mesh.base_radius = 0.02;
  rig.mesh.backlash = 6e-5;
  rig.mesh.contact = make_contact_law("linear", {{"stiffness", 1e7}, {"damping", 50}});
  return rig;
}

// Accelerations by the equations of the header, written out for four absolute angles (contact without
// clamping).
void expected_rates(const Rig& rig, const double* q, const double* w, double torque, double* a) {
  const double r = rig.mesh.base_radius, b = 0.5 * rig.mesh.backlash, x = r * (q[1] - q[2]),
               v = r * (w[1] - w[2]);
  double force = 0;
  if (x > b) force = 1e7 * (x - b) + 50 * v;
  if (x < -b) force = 1e7 * (x + b) + 50 * v;
  const Coupling &in = rig.input_coupling, &out = rig.output_coupling;
  const double input = in.stiffness * (q[0] - q[1]) + in.damping * (w[0] - w[1]);
  const double output = out.stiffness * (q[2] - q[3]) + out.damping * (w[2] - w[3]);
  a[0] = (torque - rig.motor.viscous_damping * w[0] - input) / (rig.motor.inertia + in.inertia / 2);
  a[1] = (input - rig.pinion.viscous_damping * w[1] - r * force) / (rig.pinion.inertia + in.inertia / 2);
  a[2] = (r * force - rig.gear.viscous_damping * w[2] - output) / (rig.gear.inertia + out.inertia / 2);
  a[3] = (output - rig.link.viscous_damping * w[3]) / (rig.link.inertia + out.inertia / 2);
}

TEST(GearTrain, FollowsTheEquationsOnBothFlanksAndInTheGap) {
  const Rig rig = full_rig();
  const GearTrain train(rig);
  ASSERT_EQ(train.dof(), 4);
  Random random(7);
  int forward = 0, reverse = 0, free = 0;
  for (int i = 0; i < 1000; ++i) {
    State s{};
    for (int k = 0; k < 4; ++k) s[k] = random.uniform(-0.01, 0.01), s[4 + k] = random.uniform(-0.5, 0.5);
    if (i % 3 == 0) s[2] = s[1] - random.uniform(-1e-3, 1e-3);  // stay inside the gap of +-1.5e-3 rad
    const double x = s[1] - s[2];
    (x > 1.5e-3 ? forward : x < -1.5e-3 ? reverse : free)++;
    double rate[8], expected[4];
    train.derivative(0, s.data(), 0.03, rate);
    expected_rates(rig, &s[0], &s[4], 0.03, expected);
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(rate[k], s[4 + k]);
      // rounding of sums of torques up to 100 N m, divided by the smallest inertia
      EXPECT_NEAR(rate[4 + k], expected[k], 1e-12 * (std::fabs(expected[k]) + 100 / 2e-5));
    }
  }
  EXPECT_GT(forward, 100);
  EXPECT_GT(reverse, 100);
  EXPECT_GT(free, 100);
}

TEST(GearTrain, SensorShowsTheSpringOrSpringAndDamper) {
  Rig rig = full_rig();
  State s{};
  s[0] = 0.002, s[1] = 0.0005;  // twist 0.0015 rad
  s[4] = 0.3, s[5] = -0.1;      // 0.4 rad/s
  const double spring = rig.input_coupling.stiffness * 0.0015, damper = rig.input_coupling.damping * 0.4;
  ASSERT_GT(damper, 0);
  EXPECT_NEAR(GearTrain(rig).observe(s.data(), 0).sensor_torque, spring, 1e-14);
  rig.sensor_with_damper = true;
  EXPECT_NEAR(GearTrain(rig).observe(s.data(), 0).sensor_torque, spring + damper, 1e-14);
}

// Acceleration of the first part under 1 N m, at rest in the middle of the gap: gives the inertia that it
// moves.
double felt_inertia(const Rig& rig) {
  const GearTrain train(rig);
  const State rest{};
  double rate[8];
  train.derivative(0, rest.data(), 1, rate);
  return 1 / rate[train.dof()];
}

TEST(GearTrain, RigidCouplingsAndLockedLinkRemoveDegreesOfFreedom) {
  for (bool rigid_input : {false, true})
    for (bool rigid_output : {false, true})
      for (bool locked : {false, true}) {
        Rig rig = full_rig();
        if (rigid_input) rig.input_coupling = Coupling{};
        if (rigid_output) rig.output_coupling = Coupling{};
        rig.link_locked = locked;
        const GearTrain train(rig);
        EXPECT_EQ(train.dof(), 4 - rigid_input - rigid_output - locked);
        const double inertia = rigid_input ? 2e-5 + 3e-5 : 2e-5 + 2e-6;
        EXPECT_DOUBLE_EQ(felt_inertia(rig), inertia);
      }
}

TEST(GearTrain, GearAndLinkMoveAsOneBehindARigidOutput) {
  Rig rig = full_rig();
  rig.output_coupling = Coupling{};
  const GearTrain train(rig);
  ASSERT_EQ(train.dof(), 3);
  State s{};
  s[1] = (3e-5 + 1e-6) / 0.02;  // pinion 1 um into the forward flank: 10 N, 0.2 N m on the gear
  s[5] = 0.4;  // gear and link turn: 0.002 + 0.003 N m s/rad; the flanks part at 8 mm/s: -0.4 N
  double rate[8];
  train.derivative(0, s.data(), 0, rate);
  const double torque = 0.02 * (10 - 50 * 0.02 * 0.4) - 0.005 * 0.4;
  EXPECT_NEAR(rate[5], torque / (5e-5 + 7e-4),
              1e-9 * rate[5]);  // 1 um is the difference of angles near 1.5 mrad
  const Observation o = train.observe(s.data(), 0);
  EXPECT_EQ(o.load_velocity, 0.4);
  EXPECT_TRUE(std::isnan(o.output_torque));
}

TEST(GearTrain, LockedGearIsAWallOnBothSides) {
  Rig rig = full_rig();
  rig.input_coupling = rig.output_coupling = Coupling{};
  rig.link_locked = true;
  const GearTrain train(rig);
  ASSERT_EQ(train.dof(), 1);
  for (double side : {-1.0, 1.0}) {
    const double state[2] = {side * 4e-5 / 0.02, 0};  // 10 um beyond the gap: 100 N, 2 N m
    double rate[2];
    train.derivative(0, state, 0, rate);
    EXPECT_NEAR(rate[1], -side * 2 / 5e-5, 1e-9 * 2 / 5e-5);  // 10 um is a difference of 40 and 30 um
    EXPECT_EQ(train.observe(state, 0).load_position, 0);
    EXPECT_TRUE(std::isnan(train.observe(state, 0).sensor_torque));
    EXPECT_TRUE(std::isnan(train.observe(state, 0).sensor_twist));
  }
}

TEST(GearTrain, ContactWithoutBacklashIsOddAndHasNoFreePlay) {
  Rig rig = full_rig();
  rig.mesh.backlash = 0;
  const GearTrain train(rig);
  for (double x : {1e-12, 1e-9, 1e-6, 1e-4}) {
    double forward[8], reverse[8];
    State s{};
    s[1] = x / 0.02;
    train.derivative(0, s.data(), 0, forward);
    s[1] = -x / 0.02;
    train.derivative(0, s.data(), 0, reverse);
    EXPECT_NEAR(forward[6], 0.02 * 1e7 * x / (5e-5 + 3e-6), 1e-9 * forward[6]);
    EXPECT_EQ(forward[6], -reverse[6]);
  }
  double rest[8];
  train.derivative(0, State{}.data(), 0, rest);
  for (double value : rest) EXPECT_EQ(value, 0);
}

TEST(GearTrain, SetBacklashTakesEffectAtOnceAndRefusesNonsense) {
  GearTrain train(full_rig());
  State s{};
  s[1] = 2.9e-5 / 0.02;
  double rate[8];
  train.derivative(0, s.data(), 0, rate);
  EXPECT_EQ(rate[6], 0);
  train.set_backlash(5.6e-5);
  EXPECT_EQ(train.backlash(), 5.6e-5);
  train.derivative(0, s.data(), 0, rate);
  EXPECT_NEAR(rate[6], 0.02 * 10 / (5e-5 + 3e-6),
              1e-8 * rate[6]);  // 1 um of penetration, difference of 29 and 28 um
  for (double bad : {-1e-9, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(train.set_backlash(bad), InvalidParameter);
  EXPECT_EQ(train.backlash(), 5.6e-5);
}

TEST(GearTrain, EnergyIsKineticPlusElastic) {
  const GearTrain train(full_rig());
  const State s = {0.003, 0.002, 0.0001, -0.0002, 1, 2, 3, 4};
  const double penetration = 0.02 * (0.002 - 0.0001) - 3e-5;
  const double kinetic = 0.5 * (2.2e-5 * 1 + 3.2e-5 * 4 + 5.3e-5 * 9 + 7.03e-4 * 16);
  const double elastic = 0.5 * (28 * 1e-6 + 6000 * 9e-8 + 1e7 * penetration * penetration);
  EXPECT_NEAR(train.energy(s.data()), kinetic + elastic, 1e-14);
  EXPECT_EQ(train.energy(State{}.data()), 0);
}

// dE/dt = power of the motor - dampers - contact loss, for any motion: needs no integration.
TEST(GearTrain, PowerBalanceHoldsInEveryConfiguration) {
  Random random(11);
  for (int i = 0; i < 400; ++i) {
    Rig rig = full_rig();
    if (i & 1) rig.input_coupling = Coupling{};
    if (i & 2) rig.output_coupling = Coupling{};
    rig.link_locked = i & 4;
    rig.motor_side = i & 8;
    rig.reduction_ratio = 5;
    rig.mesh.contact =
        make_contact_law("power_law", {{"stiffness", 1e8}, {"exponent", 1.5}});  // without loss
    const GearTrain train(rig);
    const int n = train.dof();
    State s{};
    for (int k = 0; k < n; ++k) s[k] = random.uniform(-0.01, 0.01), s[n + k] = random.uniform(-0.5, 0.5);
    double rate[8];
    train.derivative(0, s.data(), 0.02, rate);
    const auto energy_after = [&](double dt) {
      State moved = s;
      for (int k = 0; k < 2 * n; ++k) moved[k] += dt * rate[k];
      return train.energy(moved.data());
    };
    const double dt = 1e-7;
    const double slope = (energy_after(dt) - energy_after(-dt)) / (2 * dt);
    const Observation o = train.observe(s.data(), 0.02);
    const double power = o.motor_torque * o.motor_velocity - train.damping_power(s.data());
    const double scale = train.energy(s.data()) / 1e-3 + std::fabs(power);
    // truncation of the central difference falls with dt^2: 1.5e-9 of this scale, ten times that allowed
    EXPECT_NEAR(slope, power, 2e-8 * scale) << "configuration " << i;
  }
}

// 10 N in the mesh and a spring torque of 6000 N m/rad times the twist of the output coupling on the gear.
TEST(GearTrain, AccelerationIsThatOfTheGear) {
  Rig rig = full_rig();
  State s{};
  s[1] = (3e-5 + 1e-6) / 0.02;  // pinion 1 um into the forward flank
  s[3] = -2e-5;                 // the link behind the gear
  const double torque = 0.02 * 10 - 6000 * 2e-5;
  // 1 um is the difference of angles near 1.5 mrad: nine digits of it are left
  EXPECT_NEAR(GearTrain(rig).observe(s.data(), 0).acceleration, torque / (5e-5 + 3e-6), 1e-6);
  EXPECT_TRUE(std::isnan(GearTrain(rig).observe(s.data(), 0).motor_current));
}

TEST(GearTrain, AccelerationIsThatOfThePinionWhereTheGearIsFixed) {
  Rig rig = full_rig();
  rig.input_coupling = rig.output_coupling = Coupling{};
  rig.link_locked = true;
  rig.reduction_ratio = 50;
  rig.torque_constant = 0.04;
  State s{};  // in the middle of the gap: the motor torque alone acts
  for (const bool motor_side : {false, true}) {
    rig.motor_side = motor_side;
    const Observation o = GearTrain(rig).observe(s.data(), 0.02);
    EXPECT_DOUBLE_EQ(o.acceleration, 0.02 / (2e-5 + 3e-5)) << motor_side;  // on the axis of motor_position
    EXPECT_DOUBLE_EQ(o.motor_current, 0.5);
  }
}

// A motor-side rig and the same machine written from the load side.
TEST(GearTrain, MotorSideRigIsTheSameMachine) {
  const double n = 50;
  Rig motor_side = full_rig();
  motor_side.reduction_ratio = n;
  motor_side.motor_side = true;
  Rig load_side = full_rig();
  load_side.reduction_ratio = n;
  for (Body* body : {&load_side.motor, &load_side.pinion})
    body->inertia *= n * n, body->viscous_damping *= n * n;
  Coupling& input = load_side.input_coupling;
  input = flexible(input.stiffness * n * n, input.damping * n * n, input.inertia * n * n);
  const GearTrain a(motor_side), b(load_side);
  const State s = {0.003, 0.002, 0.0001, -0.0002, 1, 2, 3, 4};
  double rate_a[8], rate_b[8];
  a.derivative(0, s.data(), 0.01, rate_a);
  b.derivative(0, s.data(), 0.01 * n, rate_b);
  for (int k = 0; k < 8; ++k) EXPECT_NEAR(rate_a[k], rate_b[k], 1e-12 * std::fabs(rate_b[k]));
  EXPECT_NEAR(a.energy(s.data()), b.energy(s.data()), 1e-12 * b.energy(s.data()));
  const Observation on_motor = a.observe(s.data(), 0.01), on_load = b.observe(s.data(), 0.01 * n);
  EXPECT_EQ(on_motor.motor_torque, 0.01);
  EXPECT_DOUBLE_EQ(on_motor.motor_position, 0.003 * n);
  EXPECT_DOUBLE_EQ(on_motor.motor_velocity, 1 * n);
  EXPECT_NEAR(on_motor.sensor_torque, 28 * 0.001 * n,
              1e-14);  // spring of the motor shaft, twisted n times as far
  EXPECT_NEAR(on_motor.sensor_torque, on_load.sensor_torque / n, 1e-14);
  EXPECT_DOUBLE_EQ(on_motor.sensor_twist, 0.001 * n);
  EXPECT_DOUBLE_EQ(on_motor.sensor_twist_rate, -1 * n);
  EXPECT_EQ(on_motor.load_position, -0.0002);
  EXPECT_EQ(on_motor.load_velocity, 4);
  EXPECT_NEAR(on_motor.output_torque, 6000 * 0.0003, 1e-12);
  EXPECT_NEAR(a.elastic_deflection(0.01), n * b.elastic_deflection(0.01 * n), 1e-15);
}

// The state of rest under a torque, put together from the springs in series, must have no acceleration.
TEST(GearTrain, ElasticDeflectionIsTheStaticEquilibriumWithoutTheGap) {
  for (double ratio : {1.0, 30.0})
    for (double torque : {-0.05, -1e-4, 1e-4, 0.05, 2.0}) {
      Rig rig = full_rig();
      rig.link_locked = true;
      rig.motor_side = ratio > 1;
      rig.reduction_ratio = ratio;
      rig.mesh.contact =
          make_contact_law("hunt_crossley", {{"stiffness", 1e8}, {"exponent", 1.5}, {"alpha", 1}});
      const GearTrain train(rig);
      const double load = std::fabs(torque) * ratio, side = std::copysign(1, torque);
      const double gear = load / 6000, pinion = gear + (3e-5 + std::pow(load / 0.02 / 1e8, 2.0 / 3)) / 0.02;
      const double motor = pinion + load / (28 * ratio * ratio);
      const State s = {side * motor, side * pinion, side * gear, 0, 0, 0};
      double rate[8];
      train.derivative(0, s.data(), torque, rate);
      for (int k = 3; k < 6; ++k)
        EXPECT_NEAR(rate[k] * 2e-5, 0, 1e-9 * load);  // residual torque of rounded angles
      const double gap = side * 3e-5 / 0.02;
      EXPECT_NEAR(train.elastic_deflection(torque), (side * motor - gap) * ratio, 1e-12 * motor * ratio);
    }
  EXPECT_EQ(GearTrain(full_rig()).elastic_deflection(0), 0);
}

TEST(GearTrain, AngularMeshWorksInRadians) {
  Rig rig = full_rig();
  rig.mesh.base_radius = std::nan("");
  rig.mesh.backlash = 4e-3;
  rig.mesh.contact = make_contact_law("linear", {{"stiffness", 5000}, {"damping", 0}});
  const GearTrain train(rig);
  State s{};
  s[1] = 2.5e-3;  // 0.5 mrad beyond the half gap: 2.5 N m
  double rate[8];
  train.derivative(0, s.data(), 0, rate);
  EXPECT_NEAR(rate[6], 2.5 / 5.3e-5, 1e-9 * rate[6]);
  EXPECT_EQ(train.backlash(), 4e-3);
}

TEST(GearTrain, TermsActOnTheEndsThatMove) {
  Rig rig = full_rig();
  const YamlReader gravity = YamlReader::from_text("{id: gravity, amplitude: 2, phase: 0.5}", "t");
  rig.terms = {read_term(gravity), read_term(gravity)};
  double rate[8];
  GearTrain(rig).derivative(0, State{}.data(), 0, rate);
  EXPECT_DOUBLE_EQ(rate[7], -2 * 2 * std::sin(0.5) / 7.03e-4);
  EXPECT_EQ(rate[4], 0);
  rig.output_coupling = Coupling{};  // the gear then carries the link's load
  GearTrain(rig).derivative(0, State{}.data(), 0, rate);
  EXPECT_DOUBLE_EQ(rate[5], -2 * 2 * std::sin(0.5) / 7.5e-4);
  rig.link_locked = true;  // and a locked link bears it alone
  GearTrain(rig).derivative(0, State{}.data(), 0, rate);
  for (int k = 0; k < 4; ++k) EXPECT_EQ(rate[k], 0);
}

TEST(GearTrain, RefusesMasslessPartsAndAMeshWithoutLaw) {
  const auto message = [](const Rig& rig) -> std::string {
    try {
      GearTrain train(rig);
    } catch (const InvalidParameter& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message(full_rig()), "accepted");
  Rig massless = full_rig();
  massless.gear.inertia = massless.output_coupling.inertia = 0;
  EXPECT_EQ(message(massless), "inertia = 0: every moving part needs inertia");
  massless.output_coupling = Coupling{};  // now it moves with the link
  EXPECT_EQ(message(massless), "accepted");
  Rig lawless = full_rig();
  lawless.mesh.contact = nullptr;
  EXPECT_EQ(message(lawless), "mesh.contact = none: the mesh needs a contact law");
  Rig negative = full_rig();
  negative.mesh.backlash = -1e-6;
  EXPECT_EQ(message(negative), "backlash = -1e-06: must be >= 0 and finite");
}

// The same equations, with a layout that the compiler knows where the train is smooth and with one that it
// does not elsewhere.
TEST(GearTrain, DryFrictionAddsItselfAndChangesNothingElse) {
  Random random(11);
  for (int layout = 0; layout < 8; ++layout) {
    Rig rig = test::sarkar_rig(20e-6);
    rig.reduction_ratio = 3;
    rig.gear.viscous_asymmetry = 0.002;
    rig.link.inertia = 4e-5;
    rig.link.viscous_damping = 0.003;
    rig.input_coupling.rigid = layout & 1;
    rig.output_coupling.rigid = layout & 2;
    rig.link_locked = layout & 4;
    const GearTrain smooth(rig);
    ASSERT_TRUE(smooth.smooth());
    rig.motor.coulomb_friction = 0.01;
    GearTrain rubs(rig);
    ASSERT_FALSE(rubs.smooth());
    for (int i = 0; i < 100; ++i) {
      State s{};
      for (int k = 0; k < smooth.dof(); ++k)
        s[k] = random.uniform(-0.01, 0.01), s[smooth.dof() + k] = random.uniform(-0.5, 0.5);
      rubs.begin_friction(0, s.data(), {0.03, 0.02});
      double without[8], with[8];
      smooth.derivative(0, s.data(), {0.03, 0.02}, without);
      rubs.derivative(0, s.data(), {0.03, 0.02}, with);
      const double motor_speed = s[smooth.dof()];
      without[smooth.dof()] -= std::copysign(0.01 * smooth.ratio(), motor_speed) / rubs.motor_inertia();
      for (int k = 0; k < 2 * smooth.dof(); ++k)
        EXPECT_NEAR(with[k], without[k], 1e-12 * (std::fabs(with[k]) + 100 / 2e-5))
            << "layout " << layout << ", " << k;
    }
  }
}

// One inertia whose friction follows what its load takes, T = (1 - r) J a + A sin(q + p), solved by hand for
// either sign: J a = tau - c w - F - mu |T| - A sin(q + p), so
// T (1 + (1 - r) mu sign T) = (1 - r) (tau - c w - F) + r A sin(q + p).
class FrictionOfOneInertia : public testing::TestWithParam<double> {};

TEST_P(FrictionOfOneInertia, FollowsWhatItsLoadTakes) {
  const double of_load = 1 - GetParam();
  constexpr double kInertia = 0.4, kViscous = 0.9, kCoulomb = 0.8, kCoefficient = 0.2, kGravity = 3;
  Rig rig;
  rig.mesh.rigid = true;
  rig.motor = {kInertia, kViscous};
  rig.motor.coulomb_friction = kCoulomb;
  ParameterValues values = {{"coefficient", kCoefficient}, {"rotor_share", GetParam()}};
  values.set_choice("body", "motor");
  rig.terms = {make_term("load_dependent_friction", values),
               make_term("gravity", {{"amplitude", kGravity}, {"phase", 0.1}})};
  for (const double torque : {4.0, 1.5, 0.2, -3.0}) {
    GearTrain train(rig);
    double state[GearTrain::kMaxStates] = {0.7, 1.2}, rate[GearTrain::kMaxStates];
    train.begin_friction(0, state, torque);
    train.derivative(0, state, torque, rate);
    const double sliding = torque - kViscous * state[1] - kCoulomb;
    const double pull = kGravity * std::sin(state[0] + 0.1);
    const double driving = of_load * sliding + GetParam() * pull;
    const double through = driving / (1 + of_load * kCoefficient * (driving > 0 ? 1 : -1));
    EXPECT_NEAR(rate[1], (sliding - kCoefficient * std::fabs(through) - pull) / kInertia, 1e-10) << torque;
  }
  // At rest it holds against gravity up to F + mu A sin(q + p).
  const double gravity = kGravity * std::sin(0.2 + 0.1), most = kCoulomb + kCoefficient * gravity;
  for (const double share : {0.999, 1.001}) {
    GearTrain train(rig);
    double state[GearTrain::kMaxStates] = {0.2, 0};
    train.begin_friction(0, state, gravity + share * most);
    EXPECT_EQ(train.any_stuck(), share < 1);
  }
}
INSTANTIATE_TEST_SUITE_P(RotorShare, FrictionOfOneInertia, testing::Values(0, 0.4, 1));

}  // namespace
}  // namespace backlash::model
