// SPDX-License-Identifier: BSD-3-Clause
// Terms that open or load the flanks: values by hand, slopes, and that they cost no energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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

constexpr double kHalf = 2e-3, kStiffness = 4e4;  // rad, N m/rad

FlankShift shift(const std::shared_ptr<const Term>& term, int side, double load, double motor = 0,
                 double torque = 0) {
  FlankShift sum;
  term->shape({motor, load, kHalf, torque, side}, sum);
  return sum;
}

/// To a flank that bears `torque` without.
double added_load(const std::shared_ptr<const Term>& term, double penetration, double torque) {
  double sum = torque;
  term->load_flank({{0, 0, kHalf, 0, 1}, penetration, 0}, sum);
  return sum - torque;
}

/// Two free inertias, 2 and 5 kg m^2, without friction.
Rig free_rig(const std::string& text) {
  Rig rig;
  rig.motor.inertia = 2;
  rig.link.inertia = 5;
  rig.mesh.backlash = 2 * kHalf;
  rig.mesh.contact = make_contact_law("linear", {{"stiffness", kStiffness}, {"damping", 0}});
  rig.terms = {term(text)};
  return rig;
}

GearTrain::EndForces forces(const Rig& rig, double motor, double load) {
  const double state[] = {motor, load, 0, 0};
  return GearTrain(rig).end_forces(0, state, 0.0);
}

const char* const kWider = "id: backlash, angle: 1e-3";
const char* const kTooth = "id: local_fault, flank: forward, amplitude: 1e-3, position: 0.5, width: 0.2";
const char* const kBack = "id: local_fault, flank: backward, amplitude: -8e-4, position: -2, width: 0.6";
const char* const kBoth = "id: local_fault, flank: both, amplitude: 1e-3, position: 3.1, width: 0.4";
const char* const kLoadMap =
    "id: learned_map, acts_on: gap, coordinate: load_position, points: [-3, 0.1, 0.5, 4], "
    "values: [0, 5e-4, -3e-4, 2e-4]";
const char* const kMotorMap =
    "id: learned_map, acts_on: gap, coordinate: motor_position, points: [-3, 0.1, 0.5, 4], "
    "values: [0, 5e-4, -3e-4, 2e-4]";
const char* const kTorqueMap =
    "id: learned_map, acts_on: gap, coordinate: mesh_torque, points: [-100, 0, 100], "
    "values: [1e-3, 0, -1e-3]";
const char* const kHarder = "id: mesh_hardening, torque: 20, penetration: 1e-3, exponent: 3";
const char* const kSofter = "id: mesh_hardening, torque: -15, penetration: 1e-3, exponent: 2";

// Per cycle teeth that rub lose twice the share of what they store, however fast they are pressed: of a
// spring of 200 N m/rad that is pressed by 1e-3 rad 1e-4 J.
TEST(FlankTerms, HysteresisLosesTwiceItsShareOfTheEnergy) {
  const auto rubbing = term("id: mesh_hysteresis, share: 0.1, speed: 1e-9");
  for (const double turns : {0.1, 10.0}) {  // per second
    const int steps = 20000;
    double lost = 0;
    for (int k = 0; k < steps; ++k) {
      const double angle = 2 * M_PI * (k + 0.5) / steps, step = 1 / (turns * steps);
      const double d = 5e-4 * (1 - std::cos(angle)), rate = 5e-4 * 2 * M_PI * turns * std::sin(angle);
      double torque = 200 * d;
      rubbing->load_flank({{}, d, rate}, torque);
      lost += torque * rate * step;
    }
    EXPECT_NEAR(lost, 2 * 0.1 * 0.5 * 200 * 1e-6, 1e-9);  // midpoints of 20000 steps, and 1e-9 of the turning
  }
}

TEST(FlankTerms, OpeningsByHand) {
  for (const int side : {1, -1}) {
    EXPECT_DOUBLE_EQ(shift(term(kWider), side, 0.7).opening, 5e-4);
    const double turn = 2 * M_PI, one_width = std::exp(-0.5);
    // 0.2 and 2 sin(0.1) differ by 0.17 percent
    EXPECT_NEAR(shift(term(kTooth), side, 0.7).opening, side > 0 ? 1e-3 * one_width : 0, 2e-6);
    EXPECT_NEAR(shift(term(kTooth), side, 0.5 - 2 * turn).opening, side > 0 ? 1e-3 : 0, 1e-18);
    EXPECT_NEAR(shift(term(kTooth), side, 0.5 + M_PI).opening, 0, 1e-18);
    EXPECT_NEAR(shift(term(kBack), side, -2 + turn).opening, side < 0 ? -8e-4 : 0, 1e-18);
    EXPECT_NEAR(shift(term(kBoth), side, 3.1).opening, 1e-3, 1e-18);
    // forward closes where the displacement is > 0
    EXPECT_NEAR(shift(term(kLoadMap), side, 0.1).opening, -side * 5e-4, 1e-18);
    EXPECT_NEAR(shift(term(kMotorMap), side, 9, 0.5).opening, side * 3e-4, 1e-18);
    EXPECT_NEAR(shift(term(kTorqueMap), side, 0, 0, 100).opening, side * 1e-3, 1e-18);
  }
}

const char* const kUneven = "id: varying_backlash, amplitude: -0.4, order: 3, phase: 0.7";
const char* const kError = "id: transmission_error, amplitude: 5e-4, order: 7, phase: -1";

TEST(FlankTerms, NoOpeningIsBelowTheLeast) {
  for (const char* text : {kWider, kTooth, kBack, kBoth, kUneven, kError}) {
    const auto t = term(text);
    double least = INFINITY;
    for (const int side : {1, -1})
      for (double q = -3.2; q < 3.2; q += 1e-3) least = std::min(least, shift(t, side, q).opening);
    EXPECT_GE(least, t->least_opening(kHalf)) << text;
    // reached, or never below 0 far from a fault; steps of 1e-3 miss a crest of order 7 by (7e-3 / 2)^2 / 2
    EXPECT_NEAR(least, t->least_opening(kHalf), 1e-5 * kHalf) << text;
  }
  EXPECT_EQ(term(kLoadMap)->least_opening(kHalf), -INFINITY);
}

// Flanks that cannot touch are not looked up; that changes no force.
TEST(FlankTerms, ForcesAreTheSameWithFlanksThatAreKnown) {
  Rig rig = free_rig(kUneven);
  for (const char* text : {kError, kBack, kTooth}) rig.terms.push_back(term(text));
  const GearTrain train(rig);
  int far = 0, touching = 0;
  for (double load = -3.2; load < 3.2; load += 0.0137) {
    for (double x = -3 * kHalf; x < 3 * kHalf; x += 0.021 * kHalf) {
      const Motion motion{0, load + x, 0.3, load, 0.2};
      const GearTrain::Flanks flanks = train.flanks(motion.motor_position, load);
      const GearTrain::LoadForces known = train.load_forces(motion, flanks),
                                  asked = train.load_forces(motion);
      ASSERT_EQ(known.net, asked.net) << load << " " << x;
      ASSERT_EQ(known.mesh_on_motor, asked.mesh_on_motor) << load << " " << x;
      for (const FlankShift& at : flanks) far += std::isinf(at.opening);
      touching += asked.mesh_torque != 0;
    }
  }
  EXPECT_GT(far, 10000);
  EXPECT_GT(touching, 10000);
}

TEST(FlankTerms, SlopesAreThoseOfTheOpening) {
  const double d = 1e-6;
  for (const char* text : {kWider, kTooth, kBack, kBoth, kLoadMap, kMotorMap, kTorqueMap}) {
    const auto t = term(text);
    EXPECT_TRUE(t->shapes_flanks());
    EXPECT_TRUE(t->moves_load());
    EXPECT_EQ(t->shape_follows_torque(), text == kTorqueMap);
    for (const int side : {1, -1})
      for (double q = -9.03; q < 9; q += 0.0731) {
        const double m = 0.3 - q, torque = side * 40;
        const FlankShift at = shift(t, side, q, m, torque);
        const auto opening = [&](double load, double motor) {
          return shift(t, side, load, motor, torque).opening;
        };
        // rounding: 1e-16 of 1e-3 over 1e-6; third derivative, some 1e-1, times d^2
        EXPECT_NEAR(at.load_slope, (opening(q + d, m) - opening(q - d, m)) / (2 * d), 1e-9) << text << q;
        EXPECT_NEAR(at.motor_slope, (opening(q, m + d) - opening(q, m - d)) / (2 * d), 1e-9) << text << q;
      }
  }
}

TEST(FlankTerms, HardeningByHand) {
  EXPECT_TRUE(term(kHarder)->loads_flanks());
  EXPECT_FALSE(term(kHarder)->shapes_flanks());
  EXPECT_TRUE(term(kHarder)->moves_load());
  for (const double d : {1e-4, 1e-3, 2.5e-3}) {
    // softer by 0.15, 15, at most half of 100 N m
    const double harder = 20 * std::pow(d / 1e-3, 3), softer = d > 2e-3 ? -50 : -15e6 * d * d;
    EXPECT_NEAR(added_load(term(kHarder), d, 100), harder, 1e-12);
    EXPECT_NEAR(added_load(term(kSofter), d, kStiffness * d), softer, 1e-12);
    for (const int side : {1, -1}) {
      const auto torques = [&](const char* text) {
        return forces(free_rig(text), 0.3 + side * (kHalf + d), 0.3);
      };
      // rounding of 0.3 rad times the stiffness
      EXPECT_NEAR(torques(kHarder).load, side * (kStiffness * d + harder), 1e-10);
      EXPECT_NEAR(torques(kHarder).motor, -side * (kStiffness * d + harder), 1e-10);
      EXPECT_NEAR(torques(kSofter).load, side * (kStiffness * d + softer), 1e-10);
      EXPECT_NEAR(torques(kSofter).motor, -side * (kStiffness * d + softer), 1e-10);
    }
  }
  EXPECT_EQ(added_load(term(kSofter), 1e-3, 0), 0);  // the damper may have taken all
}

/// Energy that flank and term store, made up by the test.
double stored(const std::string& text, double motor, double load) {
  const auto t = term(text);
  double sum = 0;
  for (const int side : {1, -1}) {
    const double depth = side * (motor - load) - kHalf - shift(t, side, load, motor).opening;
    if (depth <= 0) continue;
    sum += 0.5 * kStiffness * depth * depth;
    if (text == kHarder) sum += 20 * std::pow(depth / 1e-3, 3) * depth / 4;
    if (text == kSofter) {  // half of the stiffness from where it takes half
      const double corner = 0.5 * kStiffness / 15e6, soft = std::min(depth, corner);
      sum -= 15e6 * soft * soft * soft / 3 + 0.25 * kStiffness * (depth * depth - soft * soft);
    }
  }
  return sum;
}

const char* const kConservative[] = {kWider, kTooth, kBack, kBoth, kLoadMap, kMotorMap, kHarder, kSofter};

TEST(FlankTerms, TorquesAreTheSlopesOfTheEnergy) {
  const double d = 1e-7;
  for (const char* text : kConservative) {
    const Rig rig = free_rig(text);
    int pressed = 0;
    for (double load = -3.513; load < 4; load += 0.05)
      for (const double twist : {-4.4e-3, -2.2e-3, 0.0, 2.2e-3, 4.4e-3}) {
        const double motor = load + twist;
        pressed += stored(text, motor, load) > 0;
        const auto at = forces(rig, motor, load);
        const auto energy = [&](double dm, double dl) { return stored(text, motor + dm, load + dl); };
        // rounding: 1e-15 rad of position times 4e4 N m/rad times depth, over d; and a touch within d
        EXPECT_NEAR(at.motor, -(energy(d, 0) - energy(-d, 0)) / (2 * d), 1e-3) << text << " " << load;
        EXPECT_NEAR(at.load, -(energy(0, d) - energy(0, -d)) / (2 * d), 1e-3) << text << " " << load;
      }
    EXPECT_GT(pressed, 200) << text;
  }
}

TEST(FlankTerms, NoEnergyIsMadeOrLost) {
  for (const char* text : kConservative) {
    simulation::Plant plant(free_rig(text), test::constant(0), test::solver(1e-11));
    simulation::Plant::State start{};
    start[2] = 3.05, start[3] = 3;
    plant.set_state(start);
    const double before = 0.5 * 2 * 3.05 * 3.05 + 0.5 * 5 * 9;
    double most_stored = 0;
    for (int k = 1; k <= 1000; ++k) {
      plant.advance_to(k * 2e-3);
      const auto& s = plant.state();
      const double elastic = stored(text, s[0], s[1]);
      most_stored = std::max(most_stored, elastic);
      ASSERT_NEAR(s[2] * s[2] + 2.5 * s[3] * s[3] + elastic, before, 1e-8 * before) << text;  // solver
    }
    EXPECT_GT(most_stored, 1e-3) << text;
    EXPECT_GT(plant.state()[1], 5.5) << text;  // rad: past all bumps
  }
}

// Torque over twist 1 / (1/k + 1/k_map): the map gives way by 1e-5 rad per N m in its middle, not at its
// ends.
TEST(FlankTerms, AMapOverTheMeshTorqueIsASpringInSeries) {
  const std::string text =
      "id: learned_map, acts_on: gap, coordinate: mesh_torque, points: [-300, -200, -100, 0, 100, 200, 300], "
      "values: [3e-3, 2e-3, 1e-3, 0, -1e-3, -2e-3, -3e-3]";
  for (const int side : {1, -1})
    for (const double depth : {1e-4, 1e-3, 4e-3}) {
      const double torque = depth / (1 / kStiffness + 1e-5);
      ASSERT_LT(torque, 200);
      EXPECT_NEAR(forces(free_rig(text), side * (kHalf + depth), 0).load, side * torque, 1e-9 * torque);
    }
}

TEST(FlankTerms, AdditionalBacklashIsThatOfTheRig) {
  Rig wide = free_rig(kWider), declared = free_rig(kWider);
  declared.terms.clear();
  declared.mesh.backlash += 1e-3;
  for (double twist = -6e-3; twist < 6e-3; twist += 1.1e-4)
    EXPECT_NEAR(forces(wide, 0.2 + twist, 0.2).load, forces(declared, 0.2 + twist, 0.2).load,
                1e-10);  // rounding of 0.2 rad times the stiffness
}

TEST(FlankTerms, RefusalsNameWhatIsWrong) {
  const std::string gap = "id: learned_map, acts_on: gap, points: [0, 1], values: [0, 1], coordinate: ";
  const std::string map = "id: learned_map, acts_on: load, coordinate: time, ";
  const struct {
    std::string text;
    const char* message;
  } cases[] = {
      {"id: backlash", "angle: is missing"},
      {"id: mesh_hardening, torque: 1, penetration: 0, exponent: 2", "penetration = 0: must be > 0"},
      {"id: mesh_hysteresis, share: 1, speed: 1", "share = 1: must be"},
      {"id: mesh_hysteresis, share: 0.1, speed: 0", "speed = 0: must be > 0"},
      {"id: mesh_hardening, torque: 1, penetration: 1, exponent: 0.5", "exponent = 0.5: must be"},
      {"id: local_fault, flank: left, amplitude: 1, position: 0, width: 1", "flank = left: must be one of"},
      {"id: local_fault, flank: both, amplitude: 1, position: 0, width: 0", "width = 0: must be > 0"},
      {gap + "load_velocity", "coordinate = load_velocity: a gap follows"},
      {gap + "motor_velocity", "coordinate = motor_velocity: a gap follows"},
      {gap + "motor_torque", "coordinate = motor_torque: must be one of"},
      {gap + "time", "coordinate = time: a gap follows"},
      {gap + "temperature", "coordinate = temperature: must be one of motor_position, load_position"},
      {map + "points: [0, 1], values: [0]", "values = [...]: one value per point, not 1"},
      {map + "points: [0], values: [0]", "points = [...]: needs at least two points, not 1"},
      {map + "points: [0, 1, 1], values: [0, 1, 2]", "points = [...]: must increase, not 1"},
      {map + "points: [0, 1], values: 3", "values = 3: "},
  };
  for (const auto& c : cases) try {
      term(c.text);
      ADD_FAILURE() << "accepted: " << c.text;
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(c.message), std::string::npos) << error.what();
    }
  ParameterValues values;
  values.set_choice("acts_on", "gap");
  values.set_choice("coordinate", "time");
  values.set_list("points", {0, 1});
  values.set_list("values", {0, 1});
  EXPECT_THROW(make_term("learned_map", values), InvalidParameter);
  values.set_choice("coordinate", "load_position");
  EXPECT_NO_THROW(make_term("learned_map", values));
}

}  // namespace
}  // namespace backlash::model
