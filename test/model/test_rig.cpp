// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/rig.h"
#include "support/data.h"
#include "support/rig_changes.h"

namespace backlash::model {
namespace {

// Valid, with every optional part; the tests below change one line of it each.
const char* const kRig =
    "name: bench\n"                                                                             // 1
    "joint: elbow\n"                                                                            // 2
    "gear_train:\n"                                                                             // 3
    "  reduction_ratio: 4\n"                                                                    // 4
    "  motor_side: false\n"                                                                     // 5
    "  motor: {inertia: 2e-5, viscous_damping: 0.004}\n"                                        // 6
    "  input_coupling: {stiffness: 28, damping: 0.01, inertia: 4e-6}\n"                         // 7
    "  pinion: {inertia: 3e-5}\n"                                                               // 8
    "  mesh:\n"                                                                                 // 9
    "    base_radius: 0.02\n"                                                                   // 10
    "    backlash: 6e-5\n"                                                                      // 11
    "    contact: {law: hunt_crossley, stiffness: 1e8, exponent: 1.5, alpha: 0.5}\n"            // 12
    "  gear: {inertia: 5e-5, viscous_damping: 0.001}\n"                                         // 13
    "  output_coupling: {stiffness: 6000, damping: 0.05}\n"                                     // 14
    "  link: {inertia: 7e-4}\n"                                                                 // 15
    "terms: [{id: gravity, amplitude: 1, phase: 0}, {id: gravity, amplitude: 2, phase: 0}]\n";  // 16

std::string changed(const std::string& from, const std::string& to) {
  std::string text = kRig;
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("not in the rig: " + from);
  return text.replace(at, from.size(), to);
}

Rig parse(const std::string& text) {
  const YamlReader yaml = YamlReader::from_text(text, "rig.yaml");
  Rig rig = read_rig(yaml);
  yaml.finish();
  return rig;
}

TEST(Rig, SensorShowsTheSpringUnlessTheFileSaysOtherwise) {
  EXPECT_FALSE(parse(kRig).sensor_with_damper);
  EXPECT_FALSE(parse(changed("inertia: 4e-6}", "inertia: 4e-6, output: spring}")).sensor_with_damper);
  EXPECT_TRUE(
      parse(changed("inertia: 4e-6}", "inertia: 4e-6, output: spring_and_damper}")).sensor_with_damper);
  EXPECT_THROW(parse(changed("inertia: 4e-6}", "inertia: 4e-6, output: damper}")), BadData);
  EXPECT_THROW(parse(changed("damping: 0.05}", "damping: 0.05, output: spring}")),
               BadData);  // no sensor there
}

TEST(Rig, ReadsEveryValue) {
  const Rig rig = parse(kRig);
  EXPECT_EQ(rig.name, "bench");
  EXPECT_EQ(rig.joint, "elbow");
  EXPECT_EQ(rig.reduction_ratio, 4);
  EXPECT_FALSE(rig.motor_side);
  EXPECT_EQ(rig.motor.inertia, 2e-5);
  EXPECT_EQ(rig.motor.viscous_damping, 0.004);
  EXPECT_FALSE(rig.input_coupling.rigid);
  EXPECT_EQ(rig.input_coupling.stiffness, 28);
  EXPECT_EQ(rig.input_coupling.damping, 0.01);
  EXPECT_EQ(rig.input_coupling.inertia, 4e-6);
  EXPECT_EQ(rig.pinion.inertia, 3e-5);
  EXPECT_EQ(rig.pinion.viscous_damping, 0);
  EXPECT_EQ(rig.mesh.base_radius, 0.02);
  EXPECT_EQ(rig.mesh.lever(), 0.02);
  EXPECT_EQ(rig.mesh.backlash, 6e-5);
  EXPECT_NEAR(rig.mesh.contact->force(1e-4, 0, 0), 100, 1e-12);
  EXPECT_EQ(rig.gear.inertia, 5e-5);
  EXPECT_EQ(rig.gear.viscous_damping, 0.001);
  EXPECT_FALSE(rig.output_coupling.rigid);
  EXPECT_EQ(rig.output_coupling.inertia, 0);
  EXPECT_FALSE(rig.link_locked);
  EXPECT_EQ(rig.link.inertia, 7e-4);
  EXPECT_EQ(rig.terms.size(), 2u);
}

TEST(Rig, TheThreeWordsForBacklashAgree) {
  const double radius = 0.02;
  EXPECT_DOUBLE_EQ(parse(changed("backlash: 6e-5", "half_gap: 3e-5")).mesh.backlash, 6e-5);
  EXPECT_DOUBLE_EQ(parse(changed("backlash: 6e-5", "backlash_angle: 3e-3")).mesh.backlash, radius * 3e-3);
  EXPECT_EQ(parse(changed("backlash: 6e-5", "backlash: 0")).mesh.backlash, 0);
}

TEST(Rig, BacklashAngleIsSeenOnTheAxisOfMotorPosition) {
  EXPECT_DOUBLE_EQ(parse(kRig).backlash_angle(6e-5), 3e-3);
  EXPECT_EQ(parse(kRig).motor_axis_ratio(), 1);
  const Rig motor_side = parse(changed("motor_side: false", "motor_side: true"));
  EXPECT_DOUBLE_EQ(motor_side.backlash_angle(6e-5), 4 * 3e-3);
  EXPECT_EQ(motor_side.motor_axis_ratio(), 4);
}

TEST(Rig, MeshWithoutBaseRadiusWorksInAngles) {
  const Rig rig = parse(changed("base_radius: 0.02\n    backlash: 6e-5", "backlash_angle: 3e-3"));
  EXPECT_TRUE(rig.mesh.angular());
  EXPECT_EQ(rig.mesh.lever(), 1);
  EXPECT_EQ(rig.mesh.backlash, 3e-3);
  EXPECT_EQ(rig.backlash_angle(3e-3), 3e-3);
}

TEST(Rig, TheBearingIsAtTheLinkUnlessItIsSaidToBeAtTheGear) {
  EXPECT_FALSE(parse(kRig).bearing_at_gear);
  EXPECT_FALSE(parse(changed("damping: 0.05}", "damping: 0.05, bearing: link}")).bearing_at_gear);
  const std::string at_gear = changed("damping: 0.05}", "damping: 0.05, bearing: gear}");
  EXPECT_TRUE(parse(at_gear).bearing_at_gear);
  EXPECT_FALSE(parse(at_gear) == parse(kRig));
}

TEST(Rig, OptionalPartsMayBeLeftOut) {
  const Rig rigid_input =
      parse(changed("{stiffness: 28, damping: 0.01, inertia: 4e-6}\n  pinion: {inertia: 3e-5}", "rigid"));
  EXPECT_TRUE(rigid_input.input_coupling.rigid);
  EXPECT_EQ(rigid_input.pinion.inertia, 0);
  const Rig rigid_with_pinion = parse(changed("{stiffness: 28, damping: 0.01, inertia: 4e-6}", "rigid"));
  EXPECT_EQ(rigid_with_pinion.pinion.inertia, 3e-5);
  const Rig rigid_output =
      parse(changed("gear: {inertia: 5e-5, viscous_damping: 0.001}\n"
                    "  output_coupling: {stiffness: 6000, damping: 0.05}",
                    "output_coupling: rigid"));
  EXPECT_TRUE(rigid_output.output_coupling.rigid);
  EXPECT_EQ(rigid_output.gear.inertia, 0);
  EXPECT_TRUE(parse(changed("link: {inertia: 7e-4}", "link: locked")).link_locked);
  EXPECT_TRUE(
      parse(changed("terms: [{id: gravity, amplitude: 1, phase: 0}, {id: gravity, amplitude: 2, phase: 0}]",
                    "terms: []"))
          .terms.empty());
  EXPECT_FALSE(parse(changed("  motor_side: false\n", "")).motor_side);
}

struct BadRig {
  const char* from;
  const char* to;
  const char* message;
};

const BadRig kWrongNumbers[] = {
    {"ratio: 4", "ratio: 0", "rig.yaml:4: gear_train.reduction_ratio = 0: must be > 0"},
    {"ratio: 4", "ratio: -4", "rig.yaml:4: gear_train.reduction_ratio = -4: must be > 0"},
    {"ratio: 4", "ratio: 4:1", "rig.yaml:4: gear_train.reduction_ratio = 4:1: not a number, must be > 0"},
    {"inertia: 2e-5", "inertia: -2e-5", "rig.yaml:6: gear_train.motor.inertia = -2e-5: must be > 0"},
    {"inertia: 2e-5", "inertia: 0", "rig.yaml:6: gear_train.motor.inertia = 0: must be > 0"},
    {"inertia: 2e-5", "inertia: '2e-5'",
     "rig.yaml:6: gear_train.motor.inertia = '2e-5': is text in quotes, expected a number"},
    {"inertia: 2e-5", "inertia: [2e-5]",
     "rig.yaml:6: gear_train.motor.inertia = [...]: is a list, expected a number"},
    {"inertia: 2e-5", "inertia: .nan",
     "rig.yaml:6: gear_train.motor.inertia = .nan: not a finite number, must be > 0"},
    {"damping: 0.004", "damping: -1", "rig.yaml:6: gear_train.motor.viscous_damping = -1: must be >= 0"},
    {"stiffness: 28", "stiffness: 0", "rig.yaml:7: gear_train.input_coupling.stiffness = 0: must be > 0"},
    {"damping: 0.01", "damping: -0.01",
     "rig.yaml:7: gear_train.input_coupling.damping = -0.01: must be >= 0"},
    {"inertia: 4e-6", "inertia: -4e-6",
     "rig.yaml:7: gear_train.input_coupling.inertia = -4e-6: must be >= 0"},
    {"radius: 0.02", "radius: 0", "rig.yaml:10: gear_train.mesh.base_radius = 0: must be > 0"},
    {"backlash: 6e-5", "backlash: -6e-5", "rig.yaml:11: gear_train.mesh.backlash = -6e-5: must be >= 0"},
    {"backlash: 6e-5", "half_gap: -3e-5", "rig.yaml:11: gear_train.mesh.half_gap = -3e-5: must be >= 0"},
    {"backlash: 6e-5", "backlash_angle: x",
     "rig.yaml:11: gear_train.mesh.backlash_angle = x: not a number, must be >= 0"},
    {"stiffness: 1e8", "stiffness: -1", "rig.yaml:12: gear_train.mesh.contact.stiffness = -1: must be > 0"},
    {"exponent: 1.5", "exponent: 2",
     "rig.yaml:12: gear_train.mesh.contact.exponent = 2: must be >= 1 and <= 1.5"},
    {"alpha: 0.5", "alpha: -0.5", "rig.yaml:12: gear_train.mesh.contact.alpha = -0.5: must be >= 0"},
    {"amplitude: 2", "amplitude: -2", "rig.yaml:16: terms[1].amplitude = -2: must be >= 0"},
};

const BadRig kWrongShapes[] = {
    {"name: bench", "name: [bench]", "rig.yaml:1: name = [...]: is a list, expected text"},
    {"name: bench\n", "", "rig.yaml:1: name: is missing, expected text"},
    {"joint: elbow\n", "", "rig.yaml:1: joint: is missing, expected text"},
    {"gear_train:", "geartrain:", "rig.yaml:1: gear_train: is missing, expected a map"},
    {"  reduction_ratio: 4\n", "", "rig.yaml:3: gear_train.reduction_ratio: is missing, expected a number"},
    {"side: false", "side: 1", "rig.yaml:5: gear_train.motor_side = 1: must be true or false"},
    {"{inertia: 2e-5, viscous_damping: 0.004}", "2e-5", "rig.yaml:6: gear_train.motor = 2e-5: must be a map"},
    {"inertia: 2e-5, viscous", "viscous",
     "rig.yaml:6: gear_train.motor.inertia: is missing, expected a number"},
    {"{stiffness: 28, damping: 0.01, inertia: 4e-6}", "stiff",
     "rig.yaml:7: gear_train.input_coupling = stiff: must be one of rigid"},
    {"stiffness: 28, damping: 0.01", "stiffness: 28",
     "rig.yaml:7: gear_train.input_coupling.damping: is missing, expected a number"},
    {"  pinion: {inertia: 3e-5}\n", "", "rig.yaml:3: gear_train.pinion: is missing, expected a map"},
    {"contact: {law: hunt_crossley", "contact: {law: hertz",
     "rig.yaml:12: gear_train.mesh.contact.law = hertz: must be one of linear, power_law, hunt_crossley"},
    {"law: hunt_crossley, ", "",
     "rig.yaml:12: gear_train.mesh.contact.law: is missing, expected one of linear, "
     "power_law, hunt_crossley"},
    {", alpha: 0.5", "", "rig.yaml:12: gear_train.mesh.contact.alpha: is missing, expected a number"},
    {"  gear: {inertia: 5e-5, viscous_damping: 0.001}\n", "",
     "rig.yaml:3: gear_train.gear: is required with a flexible output coupling"},
    {"damping: 0.05}\n  link: {inertia: 7e-4}", "damping: 0.05, bearing: gear}\n  link: locked",
     "rig.yaml:15: gear_train.link = locked: a locked link has no bearing at the gear"},
    {"link: {inertia: 7e-4}", "link: loose", "rig.yaml:15: gear_train.link = loose: must be one of locked"},
    {"  link: {inertia: 7e-4}\n", "", "rig.yaml:3: gear_train.link: is missing, expected a map"},
    {"id: gravity, amplitude: 2", "id: antigravity, amplitude: 2",
     "rig.yaml:16: terms[1].id = antigravity: must be one of "},
    {"terms: [{id", "terms: [3, {id", "rig.yaml:16: terms[0] = 3: must be a map"},
};

const BadRig kWrongBacklash[] = {
    {"    backlash: 6e-5\n", "",
     "rig.yaml:9: gear_train.mesh.backlash: exactly one of backlash, half_gap, backlash_angle must be given"},
    {"backlash: 6e-5", "backlash: 6e-5\n    half_gap: 3e-5",
     "rig.yaml:12: gear_train.mesh.half_gap = 3e-5: exactly one of backlash, half_gap, backlash_angle must "
     "be given"},
    {"backlash: 6e-5", "half_gap: 3e-5\n    backlash_angle: 3e-3",
     "rig.yaml:12: gear_train.mesh.backlash_angle = 3e-3: exactly one of backlash, half_gap, backlash_angle "
     "must be "
     "given"},
    {"base_radius: 0.02\n    backlash: 6e-5", "half_gap: 3e-5",
     "rig.yaml:10: gear_train.mesh.half_gap = 3e-5: a mesh without base_radius must state backlash_angle "
     "(rad)"},
    {"    base_radius: 0.02\n", "",
     "rig.yaml:10: gear_train.mesh.backlash = 6e-5: a mesh without base_radius must state backlash_angle "
     "(rad)"},
};

const BadRig kUnknownKeys[] = {
    {"viscous_damping: 0.004", "damping: 0.004",
     "rig.yaml:6: gear_train.motor.damping = 0.004: unknown key, known here: "},
    {"  motor_side: false\n", "  motorside: true\n",
     "rig.yaml:5: gear_train.motorside = true: unknown key, known here: "},
    {"alpha: 0.5", "alpha: 0.5, beta: 1",
     "rig.yaml:12: gear_train.mesh.contact.beta = 1: unknown key, known here: "},
    {"law: hunt_crossley", "law: power_law",
     "rig.yaml:12: gear_train.mesh.contact.alpha = 0.5: unknown key, known here: "},
    {"backlash: 6e-5", "backlash: 6e-5\n    gap: 1",
     "rig.yaml:12: gear_train.mesh.gap = 1: unknown key, known here: "},
    {"name: bench", "name: bench\ncolour: red", "rig.yaml:2: colour = red: unknown key, known here: "},
};

template <std::size_t Count>
void expect_refused(const BadRig (&cases)[Count]) {
  for (const BadRig& bad : cases) {
    try {
      parse(changed(bad.from, bad.to));
      ADD_FAILURE() << "accepted: " << bad.to;
    } catch (const BadData& error) {
      const std::string expected = bad.message, message = error.what();
      EXPECT_EQ(message.substr(0, expected.size()), expected);
    }
  }
}

TEST(Rig, WrongNumbersAreRefusedWithPlaceAndLimit) {
  expect_refused(kWrongNumbers);
}
TEST(Rig, WrongShapesAreRefusedWithPlace) {
  expect_refused(kWrongShapes);
}
TEST(Rig, BacklashMustBeStatedOnceInOneUnit) {
  expect_refused(kWrongBacklash);
}
TEST(Rig, UnknownKeysAreRefused) {
  expect_refused(kUnknownKeys);
}

TEST(Rig, FrictionIsANumberOrOneForEachDirection) {
  Rig rig = parse(changed("viscous_damping: 0.004", "coulomb_friction: 3, viscous_damping: 0.004"));
  EXPECT_EQ(rig.motor.coulomb_friction, 3);
  EXPECT_EQ(rig.motor.coulomb_asymmetry, 0);
  EXPECT_EQ(rig.motor.viscous_asymmetry, 0);
  EXPECT_EQ(rig.link.coulomb_friction, 0) << "without any";
  rig = parse(changed("viscous_damping: 0.004",
                      "coulomb_friction: {forward: 5, backward: 2}, viscous_damping: "
                      "{forward: 0, backward: 0.5}"));
  EXPECT_EQ(rig.motor.coulomb_friction, 3.5);
  EXPECT_EQ(rig.motor.coulomb_asymmetry, 1.5);
  EXPECT_EQ(rig.motor.viscous_damping, 0.25);
  EXPECT_EQ(rig.motor.viscous_asymmetry, -0.25);
  rig = parse(
      changed("link: {inertia: 7e-4}",
              "link: {inertia: 7e-4, coulomb_friction: {forward: 1, backward: 2}, viscous_damping: 4}"));
  EXPECT_EQ(rig.link.coulomb_friction, 1.5);
  EXPECT_EQ(rig.link.coulomb_asymmetry, -0.5);
  EXPECT_EQ(rig.link.viscous_damping, 4);
  EXPECT_EQ(GearTrain(rig).friction_event_count(), 1);
}

TEST(Rig, ThePlaceInTheGapMayBeStated) {
  EXPECT_EQ(parse(kRig).mesh.start_in_gap, 0);
  EXPECT_EQ(parse(changed("backlash: 6e-5", "start_in_gap: -0.4\n    backlash: 6e-5")).mesh.start_in_gap,
            -0.4);
}

const BadRig kWrongFriction[] = {
    {"viscous_damping: 0.004", "coulomb_friction: -3",
     "rig.yaml:6: gear_train.motor.coulomb_friction = -3: must be >= 0"},
    {"viscous_damping: 0.004", "coulomb_friction: {forward: 3}",
     "rig.yaml:6: gear_train.motor.coulomb_friction.backward: is missing, expected a number"},
    {"viscous_damping: 0.004", "coulomb_friction: {forward: 3, backward: -1}",
     "rig.yaml:6: gear_train.motor.coulomb_friction.backward = -1: must be >= 0"},
    {"viscous_damping: 0.004", "coulomb_friction: {forward: 3, backward: 1, sideways: 2}",
     "rig.yaml:6: gear_train.motor.coulomb_friction.sideways = 2: unknown key, known here: "},
    {"viscous_damping: 0.004", "coulomb_friction: [3, 4]",
     "rig.yaml:6: gear_train.motor.coulomb_friction = [...]: is a list, expected a number"},
    {"viscous_damping: 0.004", "viscous_damping: much",
     "rig.yaml:6: gear_train.motor.viscous_damping = much: not a number, must be >= 0"},
    {"viscous_damping: 0.001", "coulomb_friction: 3",
     "rig.yaml:13: gear_train.gear.coulomb_friction = 3: unknown key, known here: "},
    {"backlash: 6e-5", "start_in_gap: 1.5\n    backlash: 6e-5",
     "rig.yaml:11: gear_train.mesh.start_in_gap = 1.5: must be >= -1 and <= 1"},
    {"terms: [{id: gravity, amplitude: 1, phase: 0}",
     "terms: [{id: backlash_map, positions: [0, 1], backlash: [1e-3], centre: [0, 0]}",
     "rig.yaml:16: terms[0].backlash = [...]: one value per position, not 1"},
};

TEST(Rig, WrongFrictionIsRefusedWithPlace) {
  expect_refused(kWrongFriction);
}

TEST(Rig, ShippedSarkarRigHoldsTheStatedParameters) {
  const Rig rig = read_rig(YamlReader::from_file(test::package_file("config/sarkar_1997.yaml")));
  EXPECT_EQ(rig.name, "sarkar_1997");
  EXPECT_EQ(rig.motor.inertia, 2.24e-5);  // Sarkar, Ellis and Moore (1997), Table 2
  EXPECT_EQ(rig.motor.viscous_damping, 0.0048);
  EXPECT_EQ(rig.input_coupling.stiffness, 28.71);
  EXPECT_EQ(rig.pinion.inertia, 2.1e-5);
  EXPECT_EQ(rig.gear.inertia, 2.1e-5);
  EXPECT_NEAR(rig.mesh.base_radius, 0.5 * 0.03175 * std::cos(20 * M_PI / 180), 1e-6);  // given in um, cut off
  EXPECT_TRUE(rig.link_locked);
  EXPECT_EQ(GearTrain(rig).dof(), 3);
}

TEST(Rig, EqualsTheSameMachineMadeAgainAndNoOther) {
  const Rig rig = parse(kRig);
  EXPECT_TRUE(rig == parse(kRig));
  for (const test::RigChange& change : test::rig_changes()) {
    Rig other = parse(kRig);
    change.apply(other);
    EXPECT_FALSE(rig == other) << change.member;
  }
  Rig other = rig;
  other.terms.pop_back();
  EXPECT_FALSE(rig == other);
  other = rig;
  other.terms.back() = make_term("gravity", {{"amplitude", 2}, {"phase", 0.1}});
  EXPECT_FALSE(rig == other);
  EXPECT_FALSE(rig == without_load(rig)) << "a contact law that no file names";
}

}  // namespace
}  // namespace backlash::model
