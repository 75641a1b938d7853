// SPDX-License-Identifier: BSD-3-Clause
// What people read of the values of a rig file. The oracle is what is written into the text.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "backlash_diagnosis/rig_file/declared_values.h"
#include "support/data.h"

namespace backlash::rig_file {
namespace {

DeclaredValue value_of(const std::string& text, const std::string& name) {
  for (const DeclaredValue& v : declared_values(rig_file_from_text(text, "rig.yaml")))
    if (v.name == name) return v;
  ADD_FAILURE() << name;
  return {};
}

std::string with(const std::string& old, const std::string& put) {
  std::string text = default_rig_file().text;
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return text.replace(at, old.size(), put);
}

TEST(DeclaredValues, AsTheFileSaysWithItsSource) {
  const DeclaredValue v = value_of(
      with("viscous_damping: 0.0048 ", "viscous_damping: {value: 0.0048, uncertainty: 30 %, source: sheet} "),
      "motor.viscous_damping");
  EXPECT_EQ(v.value, 0.0048);
  EXPECT_EQ(v.unit, "N m s/rad");
  EXPECT_EQ(v.uncertainty, "30 %");
  EXPECT_EQ(v.source, "sheet; T2, last digit uncertain");
  EXPECT_EQ(v.quantity, 0);
}

TEST(DeclaredValues, DefaultsAreSaidToBeSome) {
  const std::string text = default_rig_file().text;
  EXPECT_EQ(value_of(text, "motor.viscous_damping").uncertainty, "50 %, by default");
  EXPECT_EQ(value_of(text, "motor.coulomb_friction").source, "not in the file");
  EXPECT_EQ(value_of(text, "motor.coulomb_friction").uncertainty, "10 % of the torque's level, by default");
  EXPECT_EQ(value_of(text, "commissioned.sensor_gain").value, 1);
  EXPECT_EQ(value_of(text, "mesh.base_radius").uncertainty, "");
}

TEST(DeclaredValues, WaveformCountsHalfOfACoupling) {
  const DeclaredValue v = value_of(with("inertia: 0.0 ", "inertia: 4.0e-6 "), "pinion.inertia");
  EXPECT_EQ(v.value, 2.1e-5);
  EXPECT_EQ(v.share, 2e-6);
}

TEST(DeclaredValues, UnitsOfCommentsStandWithTheValue) {
  const auto said = [](const std::string& comment) {
    const DeclaredValue v =
        value_of(with("m, pitch diameter 0.03175 m [T2] at a pressure angle of 20 deg [T2]", comment),
                 "mesh.base_radius");
    return v.unit + "|" + v.source;
  };
  EXPECT_EQ(said("m"), "m|");
  EXPECT_EQ(said("m, at 20 deg"), "m|at 20 deg");
  EXPECT_EQ(said("N m s/rad [T2] of [3]"), "N m s/rad|[T2] of [3]");
  EXPECT_EQ(said("kg m^2 [sheet]"), "kg m^2|sheet");
  EXPECT_EQ(said("-, turns"), "|turns");
  EXPECT_EQ(said("measured in 2024, twice"), "|measured in 2024, twice");
}

/// Of all rig files of the house: every line of the gear train that holds a number alone is there.
TEST(DeclaredValues, OfOtherMachinesToo) {
  const RigFile servo = load_rig_file(test::package_file("config/two_inertia_servo.yaml"));
  const auto all = declared_values(servo);
  EXPECT_TRUE(
      std::any_of(all.begin(), all.end(), [](const DeclaredValue& v) { return v.name == "motor.inertia"; }));
  for (const DeclaredValue& v : all) {
    EXPECT_EQ(v.quantity, -1) << v.name;
    EXPECT_EQ(v.uncertainty, "") << v.name;
  }
}

TEST(DeclaredValues, LinearTeethOfAnglesAreInNewtonMetresPerRadian) {
  const auto all = declared_values(load_rig_file(test::package_file("config/two_inertia_servo.yaml")));
  const auto found = std::find_if(all.begin(), all.end(),
                                  [](const DeclaredValue& v) { return v.name == "mesh.contact.stiffness"; });
  ASSERT_NE(found, all.end());
  EXPECT_EQ(found->unit, "N m/rad");
}

}  // namespace
}  // namespace backlash::rig_file
