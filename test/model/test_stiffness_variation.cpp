// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/stiffness_variation.h"
#include "support/data.h"
#include "support/gears.h"

namespace backlash::model {
namespace {

using test::gear_pair;
using test::sarkar_gears;

MeshStiffness mesh_of(const GearPair& pair, const std::string& law, double transition = 0) {
  return MeshStiffness(pair, {law, 1, 206e9, 0.3, transition});
}

// A mesh of 20 and 40 teeth, module 1 mm: base radius of the gear 20 mm cos 20 deg = 18.793852 mm.
const char* const kMesh =
    "name: bench\n"                                             // 1
    "joint: elbow\n"                                            // 2
    "gear_train:\n"                                             // 3
    "  reduction_ratio: 1\n"                                    // 4
    "  motor: {inertia: 1e-4}\n"                                // 5
    "  input_coupling: rigid\n"                                 // 6
    "  output_coupling: rigid\n"                                // 7
    "  link: locked\n"                                          // 8
    "  mesh:\n"                                                 // 9
    "    base_radius: 0.018793852\n"                            // 10
    "    backlash: 4e-5\n"                                      // 11
    "    contact: {law: linear, stiffness: 1e6, damping: 0}\n"  // 12
    "    stiffness_variation:\n"                                // 13
    "      law: hertz_bending\n"                                // 14
    "      phase: 0.25\n"                                       // 15
    "      transition: 0.02\n"                                  // 16
    "      youngs_modulus: 206e9\n"                             // 17
    "      poisson_ratio: 0.3\n"                                // 18
    "      gear_pair:\n"                                        // 19
    "        pinion_teeth: 20\n"                                // 20
    "        gear_teeth: 40\n"                                  // 21
    "        module: 1e-3\n"                                    // 22
    "        pressure_angle_deg: 20\n"                          // 23
    "        addendum: 1\n"                                     // 24
    "        centre_distance_change: 5e-5\n";                   // 25

Rig parse(const std::string& text) {
  const YamlReader yaml = YamlReader::from_text(text, "rig.yaml");
  Rig rig = read_rig(yaml);
  yaml.finish();
  return rig;
}

std::string changed(const std::string& from, const std::string& to) {
  std::string text = kMesh;
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("not in the rig: " + from);
  return text.replace(at, from.size(), to);
}

TEST(StiffnessVariation, FactorFollowsTheMeshCycleWithMeanOne) {
  GearPair pair = gear_pair(23, 61, 1e-3);
  pair.pinion.thinning = 30e-6;
  for (const std::string& law : mesh_stiffness_laws()) {
    const MeshStiffness mesh = mesh_of(pair, law, 0.1);
    const StiffnessVariation variation(mesh, 0.3);
    const double pitch = M_PI * 1e-3 * std::cos(20 * M_PI / 180);
    for (const double side : {1.0, -1.0}) {
      double sum = 0;
      constexpr int kPoints = 20000;
      for (int i = 0; i < kPoints; ++i) sum += variation.factor(i * pitch / kPoints, side);
      EXPECT_NEAR(sum / kPoints, 1, 1e-6) << law;  // smooth and periodic: the sum converges fast
      EXPECT_NEAR(variation.factor(0.0007 + 3 * pitch, side), variation.factor(0.0007, side), 1e-9) << law;
    }
    for (const double travel : {-0.01, 0.0, 0.0004, 0.02})
      EXPECT_NEAR(variation.factor(travel, 1), mesh.stiffness(travel / pitch + 0.3) / mesh.mean(), 1e-12)
          << law;
  }
}

// Which teeth touch, found from the teeth themselves: tooth j of the pinion is centred at angle q + j 2 pi /
// N from the line of centres, its flanks start half a base thickness ahead and behind, and a flank touches
// the mate where its contact point lies on the length of contact.
int touching(const GearPair& pair, double pinion_angle, double side) {
  const GearGeometry g = gear_geometry(pair);
  const double base_half_angle =
      0.5 * (M_PI / 2 * pair.module - pair.pinion.thinning) / g.pinion.reference_radius +
      involute(pair.pressure_angle);
  const double rb = g.pinion.base_radius, pitch_point = rb * std::tan(g.operating_pressure_angle);
  int count = 0;
  for (int j = -5; j <= 5; ++j) {
    const double centre = side * (pinion_angle + j * 2 * M_PI / pair.pinion.teeth);
    // The flank's involute starts on the base circle; the line of action leaves the base circle at the
    // operating angle behind the line of centres. What is unwound between them is the way from there to the
    // contact.
    const double unwound = rb * (centre + base_half_angle + g.operating_pressure_angle);
    const double past_pitch_point = unwound - pitch_point;
    if (past_pitch_point > -g.approach && past_pitch_point < g.recess) ++count;
  }
  return count;
}

TEST(StiffnessVariation, BothFlanksMeetAsTheirTeethDo) {
  GearPair pair = gear_pair(19, 43, 1e-3, 22);
  pair.pinion.thinning = 50e-6;
  pair.gear.addendum = 0.9;  // approach and recess differ
  pair.centre_distance_change = 80e-6;
  const MeshStiffness mesh = mesh_of(pair, "step");
  const GearGeometry& g = mesh.geometry();
  // The phase at angle 0, where a tooth is centred: its forward flank is past the pitch point by half the
  // thickness.
  const double half =
      0.5 * g.pinion.operating_tooth_thickness * g.pinion.base_radius / g.pinion.operating_radius;
  const StiffnessVariation variation(mesh, (half + g.approach) / g.base_pitch);
  int doubles = 0;
  for (double angle = -0.5; angle < 0.5; angle += 0.00137)
    for (const double side : {1.0, -1.0}) {
      const int count = touching(pair, angle, side);
      doubles += count == 2;
      EXPECT_NEAR(variation.factor(g.pinion.base_radius * angle, side), count / g.contact_ratio, 1e-6)
          << angle << " " << side;
    }
  EXPECT_GT(doubles, 100);
}

TEST(StiffnessVariation, RigFileIsRead) {
  const Rig rig = parse(kMesh);
  ASSERT_TRUE(rig.mesh.variation);
  GearPair pair = gear_pair(20, 40, 1e-3);
  pair.centre_distance_change = 5e-5;
  const StiffnessVariation expected(mesh_of(pair, "hertz_bending", 0.02), 0.25);
  for (const double travel : {0.0, 0.001, 0.0025})
    EXPECT_EQ(rig.mesh.variation->factor(travel, 1), expected.factor(travel, 1));
  EXPECT_FALSE(read_rig(YamlReader::from_file(test::package_file("config/sarkar_1997.yaml"))).mesh.variation);
}

TEST(StiffnessVariation, MeshForceAndEnergyFollowIt) {
  const Rig rig = parse(kMesh);
  const GearTrain train(rig);
  for (const double angle : {0.0011, 0.0017, -0.0012}) {  // past half the gap, 2e-5 m / r = 1.064e-3 rad
    const double state[2] = {angle, 0}, r = 0.018793852;
    const double penetration = r * std::fabs(angle) - 2e-5, side = angle > 0 ? 1 : -1;
    const double factor = rig.mesh.variation->factor(r * angle, side);
    double rate[2];
    train.derivative(0, state, 0, rate);
    EXPECT_NEAR(rate[1], -side * r * factor * 1e6 * penetration / 1e-4, 1e-9 * std::fabs(rate[1]));
    EXPECT_NEAR(train.energy(state), 0.5 * factor * 1e6 * penetration * penetration,
                1e-9 * train.energy(state));
  }
}

struct BadVariation {
  const char *from, *to, *message;
};

TEST(StiffnessVariation, NonsenseIsRefusedWithItsPlace) {
  const std::string at = "gear_train.mesh.stiffness_variation.";
  const BadVariation cases[] = {
      {"law: hertz_bending", "law: sine",
       "rig.yaml:14: @law = sine: must be one of step, lin_parker, hertz_bending"},
      {"      law: hertz_bending\n", "", "rig.yaml:13: @law: is missing"},
      {"phase: 0.25", "phase: 1.5", "rig.yaml:15: @phase = 1.5: must be >= 0 and <= 1"},
      {"transition: 0.02", "transition: 0.7", "rig.yaml:16: @transition = 0.7: must be"},
      {"      transition: 0.02\n", "", "rig.yaml:13: @transition: is missing"},
      {"modulus: 206e9", "modulus: 70e9", "rig.yaml:19: @gear_pair = {...}: youngs_modulus"},
      {"law: hertz_bending", "law: step", "rig.yaml:17: @youngs_modulus = 206e9: unknown key"},
      {"pinion_teeth: 20", "pinion_teeth: 20.5", "rig.yaml:20: @gear_pair.pinion_teeth = 20.5: "},
      {"gear_teeth: 40", "gear_teeth: 44",
       "rig.yaml:21: @gear_pair.gear_teeth = 44: the gear has base radius 0.020673"},
      {"pinion_teeth: 20", "pinion_teeth: 8", "rig.yaml:19: @gear_pair = {...}: "},
      {"_deg: 20", "_deg: 0.35", "rig.yaml:23: @gear_pair.pressure_angle_deg = 0.35: must be >= 5 and <= 45"},
      {"change: 5e-5", "change: -5e-5",
       "rig.yaml:19: @gear_pair = {...}: centre_distance_change = -5e-05: jams"},
      {"change: 5e-5", "change: 3e-3", "rig.yaml:19: @gear_pair = {...}: gear_pair = contact ratio"},
      {"base_radius: 0.018793852\n    backlash:", "backlash_angle:",
       "rig.yaml:18: @gear_pair = {...}: a mesh without base_radius has no mesh phase"},
  };
  for (const BadVariation& bad : cases) {
    std::string expected = bad.message;
    const std::size_t place = expected.find('@');
    expected.replace(place, 1, at);
    try {
      parse(changed(bad.from, bad.to));
      ADD_FAILURE() << "accepted: " << bad.to;
    } catch (const BadData& error) {
      EXPECT_EQ(std::string(error.what()).substr(0, expected.size()), expected);
    }
  }
}

}  // namespace
}  // namespace backlash::model
