// SPDX-License-Identifier: BSD-3-Clause
// How the plant finds touches for laws that depend on the impact speed, and what it makes of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/restitution.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

constexpr double kMass = 0.125, kHalfGap = 1e-3, kRadius = 0.02;

using Law = std::shared_ptr<const model::ContactLaw>;

Law remembering(double restitution = 0.7) {
  return model::make_contact_law(
      "lankarani_nikravesh",
      {{"stiffness", 1e8}, {"exponent", 1.5}, {"restitution", restitution}, {"minimum_speed", 1e-4}});
}

Law rigid(double restitution, double resting_speed = 1e-3, double damping = 100) {
  return model::make_contact_law("stereomechanical", {{"restitution", restitution},
                                                      {"resting_speed", resting_speed},
                                                      {"stiffness", 1e6},
                                                      {"damping", damping}});
}

/// A mass between two walls, x [m] from the middle.
class Between : public Plant {
 public:
  Between(const Law& law, double x, double speed, const ExcitationSettings& excitation = test::constant(0),
          const SolverSettings& solver = test::solver(1e-10), double half_gap = kHalfGap)
      : Plant(test::wall_rig(kMass, half_gap, law), excitation, solver) {
    put(x, speed);
  }
  void put(double x, double speed) {
    State state{};
    state[0] = x / kRadius;
    state[1] = speed / kRadius;
    set_state(state);
  }
  double x() const { return kRadius * state()[0]; }
  double speed() const { return kRadius * state()[1]; }
  double impact_speed() const { return gear_train().impact_speed(); }
};

TEST(Touch, EachTouchOfEitherFlankIsKeptAnew) {
  const double e = model::restitution_of_damping(0.75 * (1 - 0.49));  // what the law gives at every speed
  for (const std::string& method : integrator_methods()) {
    Between plant(remembering(), 0, 0.3, test::constant(0), test::solver(1e-9, method));
    EXPECT_EQ(plant.impact_speed(), 0);
    double speed = 0.3, t = kHalfGap / speed;
    for (int touch = 0; touch < 8; ++touch) {
      t += kHalfGap / speed;  // some of it in contact, the rest on the way back
      plant.advance_to(t);
      ASSERT_NEAR(plant.impact_speed(), speed, 1e-6 * speed) << method << ", touch " << touch;
      speed *= e;
      ASSERT_NEAR(std::fabs(plant.speed()), speed, 1e-6 * speed) << method << ", touch " << touch;
      t += std::fabs(plant.x() - std::copysign(kHalfGap, plant.speed())) / speed;
    }
  }
}

TEST(Touch, OnTheFlankAtTheStartIsATouch) {
  for (double side : {1.0, -1.0}) {
    Between plant(remembering(), side * kHalfGap, side * 0.2);
    EXPECT_DOUBLE_EQ(plant.impact_speed(), 0.2);
    plant.advance_to(3e-3);
    EXPECT_NEAR(plant.speed(), -side * 0.2 * model::restitution_of_damping(0.75 * (1 - 0.49)), 1e-8);
    Between leaving(remembering(), side * kHalfGap, -side * 0.2);
    EXPECT_EQ(leaving.impact_speed(), 0);
    Between jumping(rigid(0.5), side * kHalfGap, side * 0.2);
    EXPECT_NEAR(jumping.speed(), -side * 0.1, 1e-15);
  }
  EXPECT_EQ(Between(remembering(), 0.999999 * kHalfGap, 0.2).impact_speed(), 0);
}

TEST(Touch, ChangesForgetTheLastOne) {
  Between plant(remembering(), 0, 0.2);
  const auto touched = [&] {
    plant.put(0, 0.2);
    plant.advance_to(plant.time() + 1.5 * kHalfGap / 0.2);
    return plant.impact_speed() > 0;
  };
  ASSERT_TRUE(touched());
  plant.set_backlash(3e-3);
  EXPECT_EQ(plant.impact_speed(), 0);
  plant.reset();
  ASSERT_TRUE(touched());
  plant.set_state(plant.state());
  EXPECT_EQ(plant.impact_speed(), 0);
  ASSERT_TRUE(touched());
  plant.reset();
  EXPECT_EQ(plant.impact_speed(), 0);
}

TEST(Touch, AnExcitationThatSwitchesForgetsNothing) {
  // 2.5 ms to the wall; the torque switches every 20 us, so also within the contact of some 100 us
  Between plant(remembering(), 0, 0.4, test::square(1e-6, 25e3));
  plant.advance_to(2.54e-3);
  EXPECT_GT(plant.x(), kHalfGap) << "the test does not show what it is for";
  EXPECT_NEAR(plant.impact_speed(), 0.4, 1e-4);
  plant.advance_to(4e-3);
  EXPECT_NEAR(plant.speed(), -0.4 * model::restitution_of_damping(0.75 * (1 - 0.49)), 1e-5);
}

TEST(Touch, AtASwitchOfTheExcitationIsFoundToo) {
  for (const std::string& method : integrator_methods())
    for (int roundings = -3; roundings <= 3; ++roundings) {
      double half_gap = 0.4 * 0.05;  // 0.05 s of flight
      for (int i = 0; i < std::abs(roundings); ++i)
        half_gap = std::nextafter(half_gap, roundings < 0 ? 0 : 1);
      Between plant(rigid(0.5), 0, 0.4, test::square(0, 10), test::solver(1e-10, method), half_gap);
      plant.advance_to(0.05);
      plant.advance_to(0.06);
      EXPECT_NEAR(plant.speed(), -0.2, 1e-9) << method << ", " << roundings;
    }
}

TEST(Touch, NoTouchYetMeansTheSmallestSpeed) {
  Between inside(remembering(), kHalfGap + 1e-5, 0);
  EXPECT_EQ(inside.impact_speed(), 0);
  double rate[2];
  inside.gear_train().derivative(0, inside.state().data(), 0, rate);
  EXPECT_LT(rate[1], 0);
  inside.advance_to(1e-3);  // pushed out, never faster than without loss: m v^2 / 2 = 2/5 K d^(5/2)
  EXPECT_LT(inside.speed(), 0);
  EXPECT_GT(inside.speed(), -std::sqrt(0.8 * 1e8 * std::pow(1e-5, 2.5) / kMass));
}

// A ball that bounces under its weight: from a drop of h, flights of 2 e^k v / a, an infinite number in
// finite time.
TEST(Touch, BouncingUnderLoadEndsAtRest) {
  const double torque = 0.05, a = torque / kRadius / kMass, v = std::sqrt(2 * a * kHalfGap), first = v / a;
  for (const std::string& method : integrator_methods())
    for (double e : {0.0, 0.5, 0.9}) {
      Between plant(rigid(e), 0, 0, test::constant(torque), test::solver(1e-9, method));
      double flight = 2 * v / a, t = first;
      for (int bounce = 1; e > 0 && bounce <= 5; ++bounce) {  // highest points in between
        flight *= e;
        plant.advance_to(t + 0.5 * flight);
        EXPECT_NEAR(kHalfGap - plant.x(), std::pow(e, 2 * bounce) * kHalfGap, 1e-6 * kHalfGap)
            << method << ", " << e;
        t += flight;
      }
      plant.advance_to(first * (1 + 2 * e / (1 - e)) + 0.2);
      EXPECT_NEAR(plant.x() - kHalfGap, torque / kRadius / 1e6, 1e-10) << method << ", " << e;  // F / K
      EXPECT_NEAR(plant.speed(), 0, 1e-9) << method << ", " << e;
      if (e > 0) {
        EXPECT_LE(plant.impact_speed(), 1e-3);  // the last touch rested
      }
    }
}

// Thrown against a load that turns it round just behind the flank: a solver whose step is exact for a
// parabola would step over that.
TEST(Touch, AFlankThatClosesAndOpensWithinOneStepIsFound) {
  const double torque = 0.05, a = torque / kRadius / kMass;
  for (const std::string& method : integrator_methods())
    for (double beyond : {1e-2, 1e-5}) {  // of the half gap
      const double touch = std::sqrt(2 * a * beyond * kHalfGap),
                   v = std::sqrt(touch * touch + 2 * a * kHalfGap);
      Between plant(rigid(0.8), 0, -v, test::constant(torque), test::solver(1e-9, method));
      plant.advance_to(1.5 * (v - touch) / a);
      EXPECT_NEAR(plant.impact_speed(), touch, 1e-5 * v) << method << ", " << beyond;
      EXPECT_GT(plant.x(), -kHalfGap);
    }
}

TEST(Touch, ATinyRestingSpeedEndsAtRestOrInAnError) {
  for (const std::string& method : integrator_methods())
    for (double resting : {1e-6, 1e-12}) {
      Between plant(rigid(0.5, resting), 0, 0, test::constant(0.05), test::solver(1e-6, method));
      ASSERT_NO_THROW(plant.advance_to(0.1)) << method << ", " << resting;
      EXPECT_NEAR(plant.x() - kHalfGap, 0.05 / kRadius / 1e6, 1e-9) << method;
    }
  // Ten hours are known to 7e-12 s: bounces that short have no end.
  Between late(rigid(0.5, 1e-12), 0, 0, test::topic(), test::solver(1e-6));
  late.advance_to(36000);
  late.set_torque(0.05);
  try {
    late.advance_to(36001);
    ADD_FAILURE() << "it came to rest";
  } catch (const IntegrationError& error) {
    EXPECT_EQ(std::string(error.what()),
              "the teeth touch or a body sticks and slips without end, now at t = 36000.030030 s");
  }
}

TEST(Touch, ForceLawsSettleUnderLoadToo) {
  for (const std::string& method : integrator_methods()) {
    Between plant(remembering(0.3), 0, 0, test::constant(0.05), test::solver(1e-8, method));
    plant.advance_to(1);
    EXPECT_NEAR(plant.x() - kHalfGap, std::pow(2.5 / 1e8, 2.0 / 3), 1e-9) << method;
    EXPECT_NEAR(plant.speed(), 0, 1e-6) << method;
  }
}

TEST(Touch, WithoutBacklashNothingBounces) {
  for (double e : {0.0, 1.0})
    for (double speed : {0.0, 0.2}) {
      Between plant(rigid(e, 1e-3, 0), 0, speed, test::square(0.01, 50), test::solver(1e-8), 0);
      double most = 0;
      for (int k = 1; k <= 50; ++k) {
        plant.advance_to(k * 1e-3);
        most = std::max(most, std::fabs(plant.x()));
      }
      // both flanks together are one spring of 1e6 N/m: v / w, and twice the static deflection for each
      // switch
      EXPECT_LT(most, speed / std::sqrt(1e6 / kMass) + 2 * 6 * 0.01 / kRadius / 1e6);
      EXPECT_GT(most, 0);
    }
}

TEST(Touch, ManyBouncesKeepTheirEnergyAtRestitutionOne) {
  Between plant(rigid(1), 0, 0.5);
  const double flight = 2 * kHalfGap / 0.5;
  plant.advance_to(200.25 * flight);  // forth and back; in the middle after each whole one
  EXPECT_NEAR(plant.speed(), 0.5, 1e-7);
  EXPECT_NEAR(plant.x(), 0.5 * kHalfGap, 1e-6 * kHalfGap);
}

TEST(Touch, TurnedFarItIsTheSame) {
  model::Rig rig = test::two_body_rig(kMass, 0.2, kHalfGap, rigid(0.6));
  Plant plant(rig, test::constant(0), test::solver(1e-9));
  Plant::State state{};
  state[0] = state[1] = 1e4;  // rad
  state[2] = 0.3 / kRadius;
  plant.set_state(state);
  plant.advance_to(1.5 * kHalfGap / 0.3);
  EXPECT_NEAR(kRadius * (plant.state()[2] - plant.state()[3]), -0.6 * 0.3, 1e-8);
}

TEST(Touch, SamplingDoesNotMatter) {
  for (const Law& law : {remembering(), rigid(0.6)}) {
    model::Rig rig = test::sarkar_rig(30e-6);
    rig.mesh.contact = law;
    Plant often(rig, test::square(0.05, 10), test::solver(1e-8)),
        once(rig, test::square(0.05, 10), test::solver(1e-8));
    for (int k = 1; k <= 200; ++k) often.advance_to(k * 1e-4);
    once.advance_to(0.02);
    EXPECT_NEAR(often.observe().sensor_torque, once.observe().sensor_torque, 1e-5);
  }
}

/// Reasonable parameters of every law for the torque-sensor rig.
std::map<std::string, ParameterValues> laws_of_the_rig() {
  const ParameterValues falling = {
      {"stiffness", 2.28e8}, {"exponent", 1.5}, {"alpha", 0.5}, {"beta", 0.25}, {"minimum_speed", 5e-3}};
  return {{"linear", {{"stiffness", 5e6}, {"damping", 30}}},
          {"kelvin_voigt", {{"stiffness", 5e6}, {"damping", 30}}},
          {"power_law", {{"stiffness", 2.28e8}, {"exponent", 1.5}}},
          {"hunt_crossley", {{"stiffness", 2.28e8}, {"exponent", 1.5}, {"alpha", 0.72}}},
          {"herbert_mcwhannell", falling},
          {"yang_sun", falling},
          {"lankarani_nikravesh",
           {{"stiffness", 2.28e8}, {"exponent", 1.5}, {"restitution", 0.8}, {"minimum_speed", 5e-3}}},
          {"hertz_in_series", {{"stiffness", 2.28e8}, {"series_stiffness", 2e7}, {"damping", 30}}},
          {"jankowski", {{"stiffness", 2.28e8}, {"restitution", 0.8}, {"effective_mass", 0.047}}},
          {"stereomechanical",
           {{"restitution", 0.8}, {"resting_speed", 2e-3}, {"stiffness", 5e6}, {"damping", 30}}},
          {"foundation",
           {{"stiffness", 2.28e8},
            {"exponent", 1.5},
            {"radius", 5e-3},
            {"viscosity", 2e4},
            {"thickness", 1e-3},
            {"share", 0.5}}}};
}

TEST(Touch, TheWholeRigRunsWithEveryLaw) {
  const auto parameters = laws_of_the_rig();
  for (const model::ContactLawType& type : model::contact_laws())
    for (double half_gap : {0.0, 30e-6}) {
      model::Rig rig = test::sarkar_rig(half_gap);
      ASSERT_EQ(parameters.count(type.name), 1u) << type.name;
      rig.mesh.contact = model::make_contact_law(type.name, parameters.at(type.name));
      Plant plant(rig, test::square(0.05, 10), test::solver(1e-6));
      double most = 0, travel = 0;
      for (int k = 1; k <= 300; ++k) {
        ASSERT_NO_THROW(plant.advance_to(k * 1e-3)) << type.name;
        most = std::max(most, std::fabs(plant.observe().sensor_torque));
        travel = std::max(travel, std::fabs(plant.observe().motor_position));
      }
      EXPECT_GT(most, 0.05) << type.name;  // the torque comes through
      EXPECT_LT(most, 0.5) << type.name;   // and rings no more than by the impacts
      EXPECT_LT(travel, half_gap / 0.014917 + 4 * 0.05 / 28.71 + 1e-3) << type.name;
    }
}

}  // namespace
}  // namespace backlash::simulation
