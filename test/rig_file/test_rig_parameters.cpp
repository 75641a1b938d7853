// SPDX-License-Identifier: BSD-3-Clause
// The table of parameters against the rig files and their reader.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "support/data.h"

namespace backlash::rig_file {
namespace {

std::string servo_text() {
  return load_rig_file(test::package_file("config/two_inertia_servo.yaml")).text;
}

model::Rig servo() {
  return rig_file_from_text(servo_text(), "servo").rig;
}

TEST(RigParameters, EachSetsItsOwnNumberAndNoOther) {
  std::set<std::string> names;
  for (const RigParameter& p : servo_parameters()) {
    EXPECT_TRUE(names.insert(p.name).second) << p.name;
    if (!p.known_to(servo())) continue;
    model::Rig changed = servo();
    p.set(changed, 0.125);
    for (const RigParameter& other : servo_parameters())
      EXPECT_EQ(other.get(changed), &other == &p ? 0.125 : other.get(servo())) << p.name << " " << other.name;
  }
}

/// The reader is the oracle: what it makes of a file whose values are those of the motor shaft.
TEST(RigParameters, PowersOfTheRatioAreThoseOfTheReader) {
  std::string text = servo_text();
  text.replace(text.find("  motor:"), 0, "  motor_side: true\n");
  const model::Rig of_shaft = rig_file_from_text(text, "shaft").rig, at_load = model::load_side(of_shaft);
  for (const RigParameter& p : servo_parameters())
    EXPECT_NEAR(p.get(at_load), p.get(of_shaft) * std::pow(of_shaft.motor_axis_ratio(), p.ratio_power),
                1e-12 * std::fabs(p.get(at_load)))
        << p.name;
}

TEST(RigParameters, KeysAreThoseThatTheReaderKnows) {
  const YamlReader file = YamlReader::from_text(servo_text(), "servo");
  for (const RigParameter& p : servo_parameters()) {
    if (p.key.empty() || !p.known_to(servo()) || p.kind == ParameterKind::start_in_gap ||
        p.kind == ParameterKind::encoder_skew)  // a file need not say them
      continue;
    YamlReader map = file;
    std::string rest = p.key;
    for (std::size_t dot; (dot = rest.find('.')) != std::string::npos; rest = rest.substr(dot + 1))
      map = map.map(rest.substr(0, dot));
    EXPECT_EQ(map.number(rest, Range::any()), p.get(servo())) << p.key;
  }
}

TEST(RigParameters, DirectionsBelongToTheirMean) {
  for (const RigParameter& p : servo_parameters()) {
    if (p.is_friction() && !p.is_asymmetry()) {
      ASSERT_NE(asymmetry_of(p), nullptr) << p.name;
      EXPECT_EQ(asymmetry_of(p)->part, p.part) << p.name;
      EXPECT_EQ(asymmetry_of(p)->kind, p.kind) << p.name;
      EXPECT_EQ(asymmetry_of(p)->unit, p.unit) << p.name;
      EXPECT_EQ(asymmetry_of(p)->ratio_power, p.ratio_power) << p.name;
    } else {
      EXPECT_EQ(asymmetry_of(p), nullptr) << p.name;
    }
  }
}

TEST(RigParameters, AreFoundByNameAndByWhatTheyAre) {
  EXPECT_EQ(servo_parameter(RigPart::link, ParameterKind::viscous_friction).name, "load_viscous");
  EXPECT_EQ(servo_parameter("mesh_stiffness").kind, ParameterKind::stiffness);
  EXPECT_THROW(servo_parameter("stiffness"), InvalidParameter);
  EXPECT_THROW(servo_parameter(RigPart::link, ParameterKind::stiffness), InvalidParameter);
}

TEST(RigParameters, AMachineKnowsOnlyThoseOfItsMeshAndContactLaw) {
  EXPECT_TRUE(servo_parameter("mesh_damping").known_to(servo()));
  EXPECT_FALSE(servo_parameter("mesh_alpha").known_to(servo()));  // its law is linear
  const model::Rig rigid = load_rig_file(test::package_file("config/emps.yaml")).rig;
  EXPECT_FALSE(servo_parameter("backlash_angle").known_to(rigid));
  EXPECT_TRUE(servo_parameter("motor_coulomb").known_to(rigid));
}

}  // namespace
}  // namespace backlash::rig_file
