// SPDX-License-Identifier: BSD-3-Clause
// Terms that are torque or friction on one end: values by hand, and motions with a closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::model {
namespace {

std::shared_ptr<const Term> term(const std::string& text) {
  return read_term(YamlReader::from_text("{" + text + "}", "rig.yaml"));
}

const Motion kMotion{4.0, 0.7, -1.5, -0.3, 0.5, -20};  // t, motor q w, load q w, mesh torque

struct Ends {
  double motor, load;
};

/// The friction that a term adds in one direction, the same in the other; the other body has none.
Ends added_friction(const std::string& text) {
  const auto t = term(text);
  EXPECT_TRUE(t->has_dry_friction());
  EndFriction sum{{1, 2, 0}, {3, 4, 0}};
  t->add_friction(kMotion, sum);
  EXPECT_NEAR(sum.motor.forward - 1, sum.motor.backward - 2, 1e-14);  // rounding of sums of some N m
  EXPECT_NEAR(sum.load.forward - 3, sum.load.backward - 4, 1e-14);
  EXPECT_EQ(t->moves_load(), sum.load.forward != 3);
  return {sum.motor.forward - 1, sum.load.forward - 3};
}

Ends added_torque(const std::string& text) {
  const auto t = term(text);
  EXPECT_FALSE(t->has_dry_friction());
  EndTorques sum{1, 2};
  t->add(kMotion, sum);
  EXPECT_EQ(t->moves_load(), sum.load != 2);
  return {sum.motor - 1, sum.load - 2};
}

void expect_ends(const Ends& ends, double motor, double load) {
  EXPECT_NEAR(ends.motor, motor, 1e-14);  // rounding of sums of some N m
  EXPECT_NEAR(ends.load, load, 1e-14);
}

TEST(EndTerms, FrictionByHand) {
  const std::string stribeck = "id: stribeck, torque: 8, speed: 0.5, exponent: ";
  expect_ends(added_friction(stribeck + "1, body: motor"), 8 * std::exp(-3.0), 0);
  expect_ends(added_friction(stribeck + "2, body: motor"), 8 * std::exp(-9.0), 0);
  expect_ends(added_friction(stribeck + "2, body: load"), 0, 8 * std::exp(-1.0));
  expect_ends(added_friction("id: square_root_friction, friction: 2, body: motor"), 2 * std::sqrt(1.5), 0);
  expect_ends(added_friction("id: square_root_friction, friction: 2, body: load"), 0, 2 * std::sqrt(0.5));
  const std::string loaded = "id: load_dependent_friction, coefficient: 0.1, body: ";
  expect_ends(added_friction(loaded + "motor"), 2, 0);
  expect_ends(added_friction(loaded + "load"), 0, 2);
  const std::string periodic = "id: position_dependent_friction, amplitude: 5, order: 7, phase: 0.2, body: ";
  expect_ends(added_friction(periodic + "motor"), 5 * std::sin(7 * 0.7 + 0.2), 0);
  expect_ends(added_friction(periodic + "load"), 0, 5 * std::sin(7 * -0.3 + 0.2));
  const std::string drift = "id: friction_drift, change: 6, span: 10, ";
  expect_ends(added_friction(drift + "rate: 0, body: motor"), 6 * 0.4, 0);
  expect_ends(added_friction(drift + "rate: 0.5, body: load"), 0,
              6 * (1 - std::exp(-2.0)) / (1 - std::exp(-5.0)));
}

// Oracle: the mean over evenly spread torques, as the law is written.
TEST(EndTerms, LossOfATorqueThatFluctuatesIsTheMeanOfItsSize) {
  for (const double fluctuation : {0.0, 5.0, 20.0, 60.0}) {
    const auto loaded = term(
        "id: load_dependent_friction, coefficient: 0.1, body: motor, fluctuation_speed: 0.5, fluctuation: " +
        std::to_string(fluctuation));
    EndFriction sum{};
    loaded->add_friction(kMotion, sum);
    const double a = fluctuation * (std::fabs(kMotion.motor_velocity) - 0.5);
    double mean = 0;
    constexpr int kCount = 20'000;
    for (int i = 0; i < kCount; ++i)
      mean += std::fabs(kMotion.mesh_torque + a * ((2 * i + 1.0) / kCount - 1)) / kCount;
    EXPECT_NEAR(sum.motor.forward, 0.1 * mean, 1e-6 * mean);  // midpoint rule: 1 / count^2
    EXPECT_EQ(sum.motor.backward, sum.motor.forward);
  }
}

TEST(EndTerms, AsymmetricCoulombByHand) {
  for (const bool load : {false, true}) {
    const auto t = term(std::string("id: asymmetric_coulomb, torque: 3, body: ") + (load ? "load" : "motor"));
    EndFriction sum{{10, 10, 0}, {10, 10, 0}};
    t->add_friction(kMotion, sum);
    EXPECT_EQ(sum.motor.forward, load ? 10 : 13);
    EXPECT_EQ(sum.motor.backward, load ? 10 : 7);
    EXPECT_EQ(sum.load.forward, load ? 13 : 10);
    EXPECT_EQ(sum.load.backward, load ? 7 : 10);
    EXPECT_TRUE(t->has_dry_friction());
    EXPECT_EQ(t->moves_load(), load);
  }
}

TEST(EndTerms, TorquesByHand) {
  expect_ends(added_torque("id: asymmetric_viscous, damping: 2, body: motor"), -3, 0);
  expect_ends(added_torque("id: asymmetric_viscous, damping: 2, body: load"), 0, -1);
  expect_ends(added_torque("id: quadratic_drag, drag: 2, body: motor"), 4.5, 0);
  expect_ends(added_torque("id: quadratic_drag, drag: 2, body: load"), 0, -0.5);
  expect_ends(added_torque("id: cogging, amplitude: 4, order: 9, phase: -1"), -4 * std::sin(9 * 0.7 - 1), 0);
}

// A (1 - exp(-t / tau)) in the form with the change over a span; and through rate 0 without a jump.
TEST(EndTerms, TheDriftIsAnExponentialOfAnyRate) {
  const auto friction = [](double rate, double t) {
    ParameterValues values{{"change", 2}, {"span", 30}, {"rate", rate}};
    values.set_choice("body", "motor");
    EndFriction sum;
    make_term("friction_drift", values)->add_friction({t, 0, 0, 0, 0}, sum);
    return sum.motor.forward;
  };
  for (const double rate : {-0.3, 0.1, 0.02, 2.0}) {
    const double at_end = 2 / (1 - std::exp(-rate * 30));
    for (const double t : {0.0, 1.0, 17.0, 30.0, 60.0})
      EXPECT_NEAR(friction(rate, t), at_end * (1 - std::exp(-rate * t)),
                  1e-12 * std::exp(std::fabs(rate) * t));  // cancellation in the plain form
  }
  for (const double t : {5.0, 30.0, 45.0}) {
    EXPECT_DOUBLE_EQ(friction(0, t), 2 * t / 30);
    // to first order the linear drift times 1 + rate (span - t) / 2
    for (const double rate : {-1e-9, 1e-9, 1e-300})
      EXPECT_NEAR(friction(rate, t), 2 * t / 30 * (1 + 0.5 * rate * (30 - t)), 1e-14);
  }
  EXPECT_NEAR(friction(-1e3, 29.99), 2 * std::exp(-10), 1e-12);  // the plain form overflows
  EXPECT_DOUBLE_EQ(friction(-1e3, 30), 2);
}

/// One body of 3 kg m^2 with other friction of `coulomb`; the term acts on either name of it.
Rig one_body(const std::string& text, const std::string& body, double coulomb = 0) {
  Rig rig;
  rig.motor.inertia = 1;
  rig.link.inertia = 2;
  (body == "load" ? rig.link : rig.motor).coulomb_friction = coulomb;
  rig.mesh.rigid = true;
  rig.terms = {term(text + (body.empty() ? "" : ", body: " + body))};
  return rig;
}

/// Speed and position at t, from `speed` at position 0.
std::pair<double, double> moved(const Rig& rig, double speed, double t, double torque = 0) {
  simulation::Plant plant(rig, test::constant(torque), test::solver(1e-11));
  simulation::Plant::State start{};
  start[1] = speed;
  plant.set_state(start);
  plant.advance_to(t);
  return {plant.state()[1], plant.state()[0]};
}

// All tolerances below: some times the solver's 1e-11.
constexpr double kClose = 1e-8;

TEST(EndTermsInMotion, CoastingByQuadraticDrag) {
  for (const char* body : {"motor", "load"})
    for (const double w : {2.0, -2.0})  // J w' = -A w |w|
      EXPECT_NEAR(moved(one_body("id: quadratic_drag, drag: 1.2", body), w, 3).first,
                  w / (1 + 1.2 * 2 * 3 / 3), kClose);
}

TEST(EndTermsInMotion, CoastingByFrictionThatBends) {
  for (const char* body : {"motor", "load"})
    for (const double s : {1.0, -1.0})  // J w' = -A sqrt(w), so sqrt(w) falls by A t / (2 J)
      EXPECT_NEAR(moved(one_body("id: square_root_friction, friction: 0.6", body), 2 * s, 3).first,
                  s * std::pow(std::sqrt(2.0) - 0.6 * 3 / (2 * 3), 2), kClose);
}

TEST(EndTermsInMotion, CoastingWithAsymmetry) {
  for (const char* body : {"motor", "load"})
    for (const double s : {1.0, -1.0}) {
      EXPECT_NEAR(moved(one_body("id: asymmetric_viscous, damping: 0.6", body), 2 * s, 3).first,
                  2 * s * std::exp(-s * 0.6), kClose);
      EXPECT_NEAR(moved(one_body("id: asymmetric_coulomb, torque: 0.3", body, 0.9), 2 * s, 3).first,
                  2 * s - (s * 0.9 + 0.3), kClose);
    }
}

TEST(EndTermsInMotion, AsymmetricCoulombHoldsByDirection) {
  const Rig rig = one_body("id: asymmetric_coulomb, torque: 0.3", "motor", 0.9);
  EXPECT_EQ(moved(rig, 0, 3, 1.19).first, 0);
  EXPECT_NEAR(moved(rig, 0, 3, 1.21).first, 0.01, kClose);
  EXPECT_EQ(moved(rig, 0, 3, -0.59).first, 0);
  EXPECT_NEAR(moved(rig, 0, 3, -0.61).first, -0.01, kClose);
}

// Friction of motor and load on one body: it sticks up to their sum.
TEST(EndTermsInMotion, OneBodySticksByTheFrictionOfBothEnds) {
  Rig rig = one_body("id: asymmetric_coulomb, torque: 0.3", "load", 0.5);
  rig.motor.coulomb_friction = 1;
  for (const double below : {1.2, 1.79, -1.1, -1.19}) EXPECT_EQ(moved(rig, 0, 3, below).first, 0) << below;
  EXPECT_NEAR(moved(rig, 0, 3, 1.9).first, 0.1, kClose);
  EXPECT_NEAR(moved(rig, 0, 3, -1.4).first, -0.2, kClose);
  EXPECT_NEAR(moved(rig, 1, 1).first, 1 - 1.8 / 3, kClose);
  EXPECT_EQ(moved(rig, 1, 2).first, 0);
  rig.terms = {term(  // takes of both
      "id: position_dependent_friction, amplitude: 0.8, order: 1e-6, phase: -1.5707963267948966, body: "
      "load")};
  EXPECT_NEAR(moved(rig, 1, 1).first, 1 - 0.7 / 3, 1e-6);  // travel * order
}

TEST(EndTermsInMotion, CoastingByStribeckFriction) {
  for (const char* body : {"motor", "load"})
    for (const double s : {1.0, -1.0}) {  // J w' = -s A exp(-|w| / ws): exp(|w| / ws) falls evenly
      const double w =
          moved(one_body("id: stribeck, torque: 2, speed: 0.8, exponent: 1", body), 1.5 * s, 2).first;
      EXPECT_NEAR(w, s * 0.8 * std::log(std::exp(1.5 / 0.8) - 2 * 2 / (3 * 0.8)), kClose);
    }
}

TEST(EndTermsInMotion, FrictionTakesItsShareOfTheLoad) {
  for (const char* body : {"motor", "load"})  // J w' = T - mu |J_L w'|, two thirds of J at the load
    for (const double torque : {4.0, -4.0})
      EXPECT_NEAR(moved(one_body("id: load_dependent_friction, coefficient: 0.2", body), 0, 3, torque).first,
                  torque / (1 + 0.2 * 2 / 3), kClose);
}

TEST(EndTermsInMotion, FrictionThatVariesWithPositionTakesItsWork) {
  const double friction = 1.5, a = 1, n = 4, p = 0.3;
  for (const char* body : {"motor", "load"}) {
    const auto [w, q] =
        moved(one_body("id: position_dependent_friction, amplitude: 1, order: 4, phase: 0.3", body, friction),
              2, 2);
    EXPECT_GT(q, 2.5);
    const double work = friction * q + a / n * (std::cos(p) - std::cos(n * q + p));
    EXPECT_NEAR(0.5 * 3 * (4 - w * w), work, 10 * kClose);
  }
}

TEST(EndTermsInMotion, FrictionThatDriftsTakesItsMomentum) {
  const double r = 0.4, span = 5, t = 4;
  for (const char* body : {"motor", "load"}) {
    const double momentum = 1.5 * (t - (1 - std::exp(-r * t)) / r) / (1 - std::exp(-r * span));
    EXPECT_NEAR(moved(one_body("id: friction_drift, change: 1.5, span: 5, rate: 0.4", body), 2, t).first,
                2 - momentum / 3, kClose);
  }
}

TEST(EndTermsInMotion, CoggingCostsNoEnergy) {
  const auto potential = [](double q) { return -0.9 / 12 * std::cos(12 * q + 0.5); };
  for (const double t : {0.3, 1.1, 7.0}) {
    const auto [w, q] = moved(one_body("id: cogging, amplitude: 0.9, order: 12, phase: 0.5", ""), 0.5, t);
    EXPECT_NEAR(1.5 * w * w + potential(q), 1.5 * 0.25 + potential(0), kClose);
    EXPECT_GT(std::fabs(w - 0.5), 1e-4);
  }
}

TEST(EndTerms, FrictionIsNeverBelowZero) {
  Rig rig = one_body("id: asymmetric_coulomb, torque: -4", "motor", 0.9);
  const double state[] = {0, 0.1};
  const EndFriction friction = GearTrain(rig).end_forces(0, state, 0.0).friction;
  EXPECT_EQ(friction.motor.forward, 0);
  EXPECT_DOUBLE_EQ(friction.motor.backward, 4.9);
}

TEST(EndTerms, RefusalsNameWhatIsWrong) {
  const struct {
    const char* text;
    const char* message;
  } cases[] = {
      {"id: stribeck, torque: 1, speed: 1, exponent: 2", "body: is missing"},
      {"id: stribeck, torque: 1, speed: 1, exponent: 2, body: both",
       "body = both: must be one of motor, load"},
      {"id: stribeck, torque: 1, speed: 1, exponent: 2, body: [motor]", "body = [...]: must be one of"},
      {"id: stribeck, torque: 1, speed: 0, exponent: 2, body: load", "speed = 0: must be > 0"},
      {"id: stribeck, torque: 1, speed: 1, exponent: 0, body: load", "exponent = 0: must be"},
      {"id: asymmetric_coulomb, torque: much, body: load", "torque = much: not a number"},
      {"id: friction_drift, change: 1, span: -3, rate: 1, body: load", "span = -3: must be > 0"},
      {"id: cogging, amplitude: 1, order: -2, phase: 0", "order = -2: must be > 0"},
      {"id: quadratic_drag, body: load", "drag: is missing"},
  };
  for (const auto& c : cases) try {
      term(c.text);
      ADD_FAILURE() << "accepted: " << c.text;
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(c.message), std::string::npos) << error.what();
    }
  ParameterValues values{{"torque", 1}};
  values.set_choice("body", "gear");
  EXPECT_THROW(make_term("asymmetric_coulomb", values), InvalidParameter);
}

}  // namespace
}  // namespace backlash::model
