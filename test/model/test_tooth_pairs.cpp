// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/tooth_pairs.h"
#include "support/gears.h"

namespace backlash::model {
namespace {

constexpr double kStiffness = 1e7, kDamping = 300;  // N/m, N s/m, means over the mesh cycle

GearPair gears() {
  GearPair pair = test::gear_pair(20, 40, 1e-3);
  pair.centre_distance_change = 50e-6;
  return pair;
}

MeshCycle cycle(const std::string& law, double offset = 0, double transition = 0.02) {
  return {MeshStiffness(gears(), {law, 0.01, 206e9, 0.3, transition}), offset};
}

std::shared_ptr<const ContactLaw> linear(double damping = 0) {
  return make_contact_law("linear", {{"stiffness", kStiffness}, {"damping", damping}});
}

double ratio() {
  return gear_geometry(gears()).contact_ratio;
}
double pitch() {
  return gear_geometry(gears()).base_pitch;
}

/// At rest, forward flank.
double force(const ToothPairs& pairs, double phase, double depth) {
  return pairs.push({phase * pitch(), 0, depth, 0, 1}, *linear()).force;
}

// `step` has two pairs for phases up to contact ratio - 1, then one; on average as many as the contact ratio.
TEST(ToothPairs, StiffnessOfOnePairAndOfTwo) {
  const ToothPairs pairs(cycle("step"), {});
  const double of_one = kStiffness / ratio();
  ASSERT_GT(ratio(), 1.3);
  ASSERT_LT(ratio(), 1.9);
  // Tolerance: Simpson's rule over a life.
  EXPECT_NEAR(force(pairs, 0.5 * (ratio() - 1), 1e-6) / 1e-6, 2 * of_one, 1e-6 * of_one);
  EXPECT_NEAR(force(pairs, 0.5 * ratio(), 1e-6) / 1e-6, of_one, 1e-6 * of_one);
}

TEST(ToothPairs, WithoutErrorsTheyAreTheVaryingStiffness) {
  for (const std::string& law : mesh_stiffness_laws()) {
    const StiffnessVariation variation(cycle(law, 0.3));
    const ToothPairs pairs(cycle(law, 0.3), {});
    for (int i = -200; i < 200; ++i)
      for (const int side : {1, -1}) {
        const double travel = 0.0137 * i * pitch();
        EXPECT_NEAR(pairs.push({travel, 0, 2e-6, 0, side}, *linear()).force,
                    2e-6 * kStiffness * variation.factor(travel, side), 1e-9)
            << law << " " << i;
      }
  }
}

// Two pairs of one stiffness, one of which lies back: alone it takes all until the other touches.
TEST(ToothPairs, APairThatLiesBackTouchesLater) {
  ToothErrors errors;
  errors.pinion.of_tooth[1] = 3e-6;
  errors.gear.of_tooth[1] = 1e-6;
  const ToothPairs pairs(cycle("step"), errors);
  const double k = kStiffness / ratio();
  // Pairs 1 and 0 touch; pair 1 has come last and lies back by 4 um.
  const double phase = 1 + 0.5 * (ratio() - 1);
  const auto expected = [&](double d) { return k * d + k * std::max(0.0, d - 4e-6); };
  for (const double d : {1e-6, 3.9e-6, 4.1e-6, 10e-6})
    EXPECT_NEAR(force(pairs, phase, d), expected(d), 1e-6 * expected(d)) << d;
  // Pair 1 alone, and pair 0 with the one before it, tooth 19 of the pinion.
  EXPECT_NEAR(force(pairs, 1 + 0.5 * ratio(), 10e-6), k * 6e-6, 1e-6 * k * 6e-6);
  EXPECT_NEAR(force(pairs, 0.5 * (ratio() - 1), 10e-6), 2 * k * 10e-6, 1e-5 * k * 1e-6);
  // The same tooth of the pinion meets that of the gear again after 40 pairs, itself after 20.
  EXPECT_NEAR(force(pairs, 41 + 0.5 * ratio(), 10e-6), k * 6e-6, 1e-6 * k * 6e-6);
  EXPECT_NEAR(force(pairs, 21 + 0.5 * ratio(), 10e-6), k * 7e-6, 1e-6 * k * 7e-6);
}

// A tooth of the pinion that stands back by p: its forward flank touches p later, its other flank p earlier.
// It does so where the tooth's middle is as far before or behind the line of centres: on either flank alone
// in contact for 2 - contact ratio of a pitch, the middle of which is half a life after the first touch.
TEST(ToothPairs, AToothThatStandsBackStandsOutOnItsOtherFlank) {
  ToothErrors errors;
  errors.pinion.of_tooth[3] = 2e-6;
  const ToothPairs pairs(cycle("step"), errors);
  const GearGeometry g = gear_geometry(gears());
  const double forward = (3 + 0.5 * ratio()) * pitch();
  // Forward the tooth is at its pitch point after the approach, on its other flank one tooth thickness later.
  const double thickness =
      g.pinion.operating_tooth_thickness * g.pinion.base_radius / g.pinion.operating_radius;
  const double at_pitch_point = 3 * pitch() + g.approach, reverse_pitch_point = at_pitch_point + thickness;
  const double reverse = reverse_pitch_point - (0.5 * ratio() * pitch() - g.approach);
  const double k = kStiffness / ratio();
  EXPECT_NEAR(pairs.push({forward, 0, 10e-6, 0, 1}, *linear()).force, k * 8e-6, 1e-6 * k * 8e-6);
  EXPECT_NEAR(pairs.push({reverse, 0, 10e-6, 0, -1}, *linear()).force, k * 12e-6, 1e-6 * k * 12e-6);
  EXPECT_NEAR(pairs.push({reverse + pitch(), 0, 10e-6, 0, -1}, *linear()).force, k * 10e-6, 1e-6 * k * 10e-6);
  EXPECT_NEAR(pairs.most_protrusion(), 2e-6, 1e-12);
}

ToothErrors all_errors() {
  ToothErrors errors;
  errors.slope = 4e-6, errors.crown = 3e-6;
  errors.pinion.runout = 5e-6, errors.pinion.phase = 0.4;
  errors.gear.runout = 7e-6, errors.gear.phase = 1.9;
  errors.gear.of_tooth[5] = -6e-6;
  return errors;
}

/// A rig with 20 and 40 teeth whose four parts the state names.
Rig rig_with(const ToothErrors& errors, double damping) {
  Rig rig;
  rig.mesh.base_radius = gear_geometry(gears()).gear.base_radius;
  rig.mesh.backlash = 20e-6;
  rig.mesh.contact = linear(damping);
  rig.mesh.pairs = std::make_shared<ToothPairs>(cycle("hertz_bending", 0.2, 0.1), errors);
  rig.motor.inertia = 1e-4;
  rig.link.inertia = 3e-4;
  return rig;
}

// The torques at rest are the slopes of the energy, by central differences; the energy is the integral of the
// law, which the tests of the laws check.
TEST(ToothPairs, TorquesAreTheSlopesOfTheEnergy) {
  const Rig rig = rig_with(all_errors(), 0);
  const GearTrain train(rig);
  const double r = rig.mesh.base_radius, h = 1e-9;
  Random random(4);
  int pressed = 0;
  for (int i = 0; i < 500; ++i) {
    const double q = 20 * (random.uniform() - 0.5), x = 60e-6 * (random.uniform() - 0.5);
    double rate[4];
    const double state[] = {q, q - x / r, 0, 0};
    train.derivative(0, state, {}, rate);
    for (const int part : {0, 1}) {
      double up[] = {state[0], state[1], 0, 0}, down[] = {state[0], state[1], 0, 0};
      up[part] += h, down[part] -= h;
      const double torque = -(train.energy(up) - train.energy(down)) / (2 * h);
      const double inertia = part == 0 ? rig.motor.inertia : rig.link.inertia;
      // Roundings of 1e-3 J by differences of 2e-9 rad, and the third derivative of the stiffness.
      EXPECT_NEAR(rate[2 + part] * inertia, torque, 1e-4 * std::fabs(torque) + 1e-6) << i << " " << part;
      pressed += torque != 0;
    }
  }
  EXPECT_GT(pressed, 500);  // of 1000: two thirds lie outside the gap
}

// c x' of Eq. 2.4, each pair less the rate at which its own error changes.
TEST(ToothPairs, DampingGoesWithThePair) {
  ToothErrors errors;
  errors.slope = 4e-6;
  const ToothPairs pairs(cycle("step"), errors);
  const double phase = 0.5 * ratio(), speed = 0.2, rate = 1e-3, depth = 10e-6;  // one pair, in its middle
  const double error_rate = 4e-6 / (ratio() * pitch()) * speed;
  const double force = pairs.push({phase * pitch(), speed, depth, rate, 1}, *linear(kDamping)).force;
  const double expected = (kStiffness * depth + kDamping * (rate - error_rate)) / ratio();
  EXPECT_NEAR(force, expected, 1e-6 * expected);
}

TEST(ToothPairs, NothingTouchesBeforeTheMostProtrusion) {
  const ToothPairs pairs(cycle("step", 0, 0.3), all_errors());
  double first = 1;
  for (int i = 0; i < 40000; ++i)
    for (const int side : {1, -1}) {
      const double travel = i * 0.001 * pitch();
      EXPECT_EQ(pairs.push({travel, 0, -pairs.most_protrusion(), 0, side}, *linear()).force, 0);
      for (double d = -pairs.most_protrusion(); d < first; d += 1e-7)
        if (pairs.push({travel, 0, d, 0, side}, *linear()).force > 0) {
          first = d;
          break;
        }
    }
  // All errors together meet at no place, so it is a bound: 5 + 7 + 6 um and what the form adds.
  EXPECT_LT(first, -10e-6);
}

TEST(ToothPairs, NonsenseIsRefused) {
  EXPECT_THROW(ToothPairs(cycle("step", 0, 0), {}), InvalidParameter);
  Rig rig = rig_with({}, 0);
  rig.mesh.contact =
      make_contact_law("stereomechanical",
                       {{"restitution", 0.8}, {"resting_speed", 1e-3}, {"stiffness", 1e8}, {"damping", 0}});
  ASSERT_TRUE(rig.mesh.contact->needs_impact_speed());
  EXPECT_THROW(GearTrain{rig}, InvalidParameter);
  const auto read = [](const std::string& mesh) {
    const YamlReader yaml = YamlReader::from_text(
        "law: step\nphase: 0\ntransition: 0.05\n"
        "gear_pair: {pinion_teeth: 20, gear_teeth: 40, module: 1e-3, pressure_angle_deg: 20, addendum: 1}\n" +
            mesh,
        "mesh.yaml");
    const auto pairs = read_tooth_pairs(yaml, 0.018793852);
    yaml.finish();
    return pairs;
  };
  EXPECT_NEAR(read("errors: {slope: 2e-6, gear: {runout: 3e-6, phase: 1}}")->most_protrusion(), 4e-6, 0.1e-6);
  EXPECT_EQ(read("")->most_protrusion(), 0);
  for (const std::string wrong :
       {"errors: {pinion: {runout: 1e-6}}", "errors: {pinion: {teeth: [{tooth: 20, error: 1e-6}]}}",
        "errors: {gear: {teeth: [{tooth: 2, error: 1e-6}, {tooth: 2, error: 1e-6}]}}",
        "errors: {sloppe: 1e-6}"})
    EXPECT_THROW(read(wrong), BadData) << wrong;
}

}  // namespace
}  // namespace backlash::model
