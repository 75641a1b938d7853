// SPDX-License-Identifier: BSD-3-Clause
// Several rigs at once against the same rigs one by one, moved by other code: Plant, SUNDIALS and Verner's
// pair.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/ensemble.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

/// Every combination of couplings and ends, with different numbers everywhere.
model::Rig rig_of(bool motor_apart, bool link_apart, bool locked) {
  model::Rig rig = test::sarkar_rig(40e-6);
  rig.reduction_ratio = 2;
  rig.motor.viscous_asymmetry = 0.001;
  rig.gear.viscous_damping = 0.003;
  rig.link.inertia = 5e-5;
  rig.link.viscous_damping = 0.002;
  rig.link_locked = locked;
  rig.input_coupling.rigid = !motor_apart;
  rig.output_coupling.rigid = !link_apart;
  rig.output_coupling.stiffness = 300;
  return rig;
}

std::vector<model::Rig> different(const model::Rig& rig, int count) {
  std::vector<model::Rig> rigs(count, rig);
  for (int i = 0; i < count; ++i) {
    rigs[i].mesh.backlash *= 0.5 + 0.2 * i;
    rigs[i].motor.inertia *= 1 + 0.03 * i;
    rigs[i].input_coupling.stiffness *= 1 - 0.02 * i;
  }
  return rigs;
}

/// Largest difference of any state from that of a plant, relative to the largest state of its kind. Short
/// enough that no gap has become chaotic.
double largest_error(const std::vector<model::Rig>& rigs, const ExcitationSettings& excitation,
                     double tolerance) {
  Ensemble ensemble(rigs, excitation, test::solver(tolerance));
  double worst = 0;
  std::vector<std::vector<double>> all;
  for (int k = 1; k <= 30; ++k) {
    ensemble.advance_to(k * 1e-3);
    for (std::size_t i = 0; i < rigs.size(); ++i) {
      const std::vector<double> state = ensemble.state(i);
      all.push_back(state);
    }
  }
  std::vector<double> size(ensemble.state(0).size());
  for (const auto& state : all)
    for (std::size_t s = 0; s < size.size(); ++s) size[s] = std::max(size[s], std::fabs(state[s]));
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    Plant plant(rigs[i], excitation, test::solver(1e-12, "verner"));
    for (int k = 1; k <= 30; ++k) {
      plant.advance_to(k * 1e-3);
      for (std::size_t s = 0; s < size.size(); ++s)
        worst = std::max(worst, std::fabs(all[(k - 1) * rigs.size() + i][s] - plant.state()[s]) / size[s]);
    }
  }
  return worst;
}

TEST(Ensemble, MovesEveryLayoutAsPlantsDo) {
  for (const bool motor_apart : {false, true})
    for (const bool link_apart : {false, true})
      for (const bool locked : {false, true}) {
        const auto rigs = different(rig_of(motor_apart, link_apart, locked), 3);
        SCOPED_TRACE("motor apart " + std::to_string(motor_apart) + ", link apart " +
                     std::to_string(link_apart) + ", locked " + std::to_string(locked));
        // Local errors of 1e-10 in some 1e4 steps, with impacts that amplify: 1e-6, and less when tighter.
        EXPECT_LT(largest_error(rigs, test::square(0.05, 50), 1e-10), 1e-6);
      }
}

TEST(Ensemble, TakesAnyNumberOfRigs) {
  for (const int count : {1, 2, 4, 5, 9})
    EXPECT_LT(largest_error(different(rig_of(true, true, true), count), test::square(0.05, 50), 1e-10), 1e-6)
        << count;
}

TEST(Ensemble, ErrorFallsWithTheTolerance) {
  const auto rigs = different(rig_of(true, true, true), 4);
  double before = std::numeric_limits<double>::infinity();
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    const double error = largest_error(rigs, test::square(0.05, 50), tolerance);
    EXPECT_LT(error, 0.3 * before)
        << tolerance;  // 0.01 if it were proportional; kinks of the contact take their part
    before = error;
  }
}

TEST(Ensemble, EveryContactLawThatHasNumbers) {
  const std::pair<const char*, ParameterValues> laws[] = {
      {"hunt_crossley", {{"stiffness", 2e8}, {"exponent", 1.5}, {"alpha", 0.7}}},
      {"hunt_crossley", {{"stiffness", 2e7}, {"exponent", 1.2}, {"alpha", 0.3}}},
      {"power_law", {{"stiffness", 2e8}, {"exponent", 1.5}}},
      {"linear", {{"stiffness", 1e6}, {"damping", 0}}}};
  for (const auto& [name, values] : laws) {
    model::Rig rig = rig_of(true, true, true);
    rig.mesh.contact = model::make_contact_law(name, values);
    EXPECT_LT(largest_error(different(rig, 2), test::square(0.05, 50), 1e-10), 1e-5) << name;
  }
}

TEST(Ensemble, EveryShapeOfTorqueAtEitherEnd) {
  ExcitationSettings sine = test::square(0.05, 50);
  sine.type = "sine";
  ExcitationSettings at_load = sine;
  at_load.at_load = true;
  EXPECT_LT(largest_error(different(rig_of(true, true, true), 2), sine, 1e-10), 1e-6);
  EXPECT_LT(largest_error(different(rig_of(true, true, false), 2), at_load, 1e-10), 1e-6);
}

TEST(Ensemble, ObservesWhatAPlantObserves) {
  const auto rigs = different(rig_of(true, true, false), 3);
  Ensemble ensemble(rigs, test::square(0.05, 50), test::solver(1e-10));
  ensemble.advance_to(0.01);  // a switch: the torque is that after it
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    Plant plant(rigs[i], test::square(0.05, 50), test::solver(1e-12));
    plant.advance_to(0.01);
    const model::Observation a = ensemble.observe(i), b = plant.observe();
    EXPECT_EQ(a.motor_torque, -0.05);
    EXPECT_NEAR(a.motor_position, b.motor_position, 1e-6 * std::fabs(b.motor_position));
    EXPECT_NEAR(a.sensor_torque, b.sensor_torque, 1e-5 * std::fabs(b.sensor_torque));
    EXPECT_NEAR(a.load_position, b.load_position, 1e-6 * std::fabs(b.load_position));
  }
}

// To the last bit: in lanes beside others, in a group that is not full and alone by the same operations. The
// samples are closer together than the steps, so that some rigs are ahead of what is asked for.
TEST(Ensemble, WhatARigDoesDoesNotDependOnTheOthers) {
  for (const char* type : {"square", "sine"}) {
    ExcitationSettings excitation = test::square(0.05, 50);
    excitation.type = type;
    const auto rigs = different(rig_of(true, true, true), 13);
    Ensemble all(rigs, excitation, test::solver(1e-6));
    std::vector<std::unique_ptr<Ensemble>> alone;
    for (const model::Rig& rig : rigs)
      alone.push_back(std::make_unique<Ensemble>(std::vector{rig}, excitation, test::solver(1e-6)));
    for (int k = 1; k <= 3000; ++k) {
      const double t = k * 1e-5;
      all.advance_to(t);
      for (std::size_t i = 0; i < rigs.size(); ++i) {
        alone[i]->advance_to(t);
        ASSERT_EQ(all.state(i), alone[i]->state(0)) << type << ", rig " << i << " at " << t;
      }
    }
  }
}

// As often as it is looked at.
TEST(Ensemble, LooksInBetweenChangeNothing) {
  const auto rigs = different(rig_of(true, true, true), 9);
  Ensemble often(rigs, test::square(0.05, 50), test::solver(1e-6)),
      once(rigs, test::square(0.05, 50), test::solver(1e-6));
  for (int k = 1; k <= 50; ++k) often.advance_to(k * 1e-3);
  once.advance_to(0.05);
  for (std::size_t i = 0; i < rigs.size(); ++i) EXPECT_EQ(often.state(i), once.state(i));
}

TEST(Ensemble, LeavesToPlantsWhatIsNotSmooth) {
  const ExcitationSettings square = test::square(0.05, 50);
  const model::Rig smooth = rig_of(true, true, true);
  EXPECT_TRUE(Ensemble::takes({smooth}, square));
  EXPECT_FALSE(Ensemble::takes({}, square));
  EXPECT_FALSE(Ensemble::takes({smooth, rig_of(true, false, true)}, square)) << "other layout";
  model::Rig rubs = smooth;
  rubs.motor.coulomb_friction = 0.01;
  EXPECT_FALSE(Ensemble::takes({smooth, rubs}, square));
  model::Rig other = smooth;
  other.mesh.contact = model::make_contact_law("linear", {{"stiffness", 1e6}, {"damping", 0}});
  EXPECT_FALSE(Ensemble::takes({smooth, other}, square)) << "other exponent";
  model::Rig remembers = smooth;
  remembers.mesh.contact = model::make_contact_law(
      "stereomechanical",
      {{"restitution", 0.5}, {"resting_speed", 1e-3}, {"stiffness", 1e6}, {"damping", 10}});
  EXPECT_FALSE(Ensemble::takes({remembers}, square));
  EXPECT_FALSE(Ensemble::takes({smooth}, test::topic()));
  ExcitationSettings braked = square;
  braked.motor_brake = true;
  EXPECT_FALSE(Ensemble::takes({smooth}, braked));
  EXPECT_THROW(Ensemble({rubs}, square, test::solver(1e-6)), InvalidParameter);
}

TEST(Ensemble, RefusesTimesThatItCannotReach) {
  Ensemble ensemble({rig_of(true, true, true)}, test::square(0.05, 50), test::solver(1e-6));
  ensemble.advance_to(0.01);
  EXPECT_EQ(ensemble.time(), 0.01);
  EXPECT_THROW(ensemble.advance_to(0.005), InvalidParameter);
  EXPECT_THROW(ensemble.advance_to(std::nan("")), InvalidParameter);
  EXPECT_THROW(ensemble.advance_to(std::numeric_limits<double>::infinity()), InvalidParameter);
  ensemble.advance_to(0.02);
}

// Damping in another unit: a time constant of 1e-14 s. Given up within seconds instead of going on for years.
TEST(Ensemble, AMachineThatIsTooStiffIsGivenUp) {
  model::Rig rig = test::sarkar_rig(40e-6);
  rig.motor.viscous_damping = 2e9;
  Ensemble ensemble({rig}, test::square(0.05, 10), test::solver(1e-6));
  EXPECT_THROW(ensemble.advance_to(1e-3), IntegrationError);
}

}  // namespace
}  // namespace backlash::simulation
