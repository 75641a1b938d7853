// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/fitted_rig.h"
#include "support/servo.h"

namespace backlash::identification {
namespace {

/// An identification that has found all that `rig` (load side) says.
Identification found_as(const model::Rig& rig, std::initializer_list<const char*> names) {
  Identification found;
  found.rig = rig;
  for (const char* name : names) {
    found.parameters[name] = {1, 0.25};
    found.units[name] = "unit";
  }
  return found;
}

TEST(FittedRig, ValuesAreThoseFoundAndTheRestStays) {
  const rig_file::RigFile declared = test::servo_file();
  model::Rig rig = test::other_servo();
  rig.mesh.start_in_gap = -0.25;
  const std::string text = fitted_rig_text(
      declared,
      found_as(rig, {"motor_inertia", "load_inertia", "mesh_stiffness", "mesh_damping", "backlash_angle",
                     "motor_coulomb", "motor_viscous", "load_coulomb", "load_viscous"}));
  const rig_file::RigFile fitted = rig_file::rig_file_from_text(text, "fitted.yaml");
  EXPECT_EQ(fitted.rig.motor.inertia, 7.8);
  EXPECT_EQ(fitted.rig.motor.viscous_damping, 10);
  EXPECT_EQ(fitted.rig.motor.coulomb_friction, 47);
  EXPECT_EQ(fitted.rig.link.inertia, 84);
  EXPECT_EQ(fitted.rig.link.coulomb_friction, 18);
  EXPECT_EQ(fitted.rig.link.viscous_damping, 7);
  EXPECT_EQ(fitted.rig.mesh.contact_spec().values.at("stiffness"), 400e3);
  EXPECT_EQ(fitted.rig.mesh.contact_spec().values.at("damping"), 560);
  EXPECT_EQ(fitted.rig.mesh.backlash, 6.3e-4);
  EXPECT_EQ(fitted.rig.mesh.start_in_gap, -0.25);
  EXPECT_NE(text.find("fitted +- 0.25"), std::string::npos);
  for (const char* kept : {"reduction_ratio: 110            # -", "solver:", "stiffness_uncertainty: 0.2"})
    EXPECT_NE(text.find(kept), std::string::npos) << kept;
}

TEST(FittedRig, OnlyWhatWasFoundIsChanged) {
  const rig_file::RigFile declared = test::servo_file();
  const std::string text = fitted_rig_text(declared, found_as(test::other_servo(), {"load_inertia"}));
  const rig_file::RigFile fitted = rig_file::rig_file_from_text(text, "fitted.yaml");
  EXPECT_EQ(fitted.rig.link.inertia, 84);
  EXPECT_EQ(fitted.rig.motor.inertia, declared.rig.motor.inertia);
  EXPECT_EQ(fitted.rig.mesh.backlash, declared.rig.mesh.backlash);
}

TEST(FittedRig, DirectionsAreWrittenApart) {
  model::Rig rig = test::other_servo();
  rig.motor.coulomb_asymmetry = 3;
  const rig_file::RigFile servo = test::servo_file();
  const rig_file::RigFile fitted =
      rig_file::rig_file_from_text(fitted_rig_text(servo, found_as(rig, {"motor_coulomb"})), "fitted.yaml");
  EXPECT_EQ(fitted.rig.motor.coulomb_friction, 47);
  EXPECT_EQ(fitted.rig.motor.coulomb_asymmetry, 3);
  const rig_file::RigFile emps =
      rig_file::load_rig_file(test::package_file("config/emps.yaml"));  // a map on lines of its own
  model::Rig axis = emps.rig;
  axis.motor.inertia = 90;
  axis.motor.coulomb_friction = 22;
  axis.motor.coulomb_asymmetry = -2;
  const rig_file::RigFile one = rig_file::rig_file_from_text(
      fitted_rig_text(emps, found_as(axis, {"inertia", "viscous", "coulomb", "offset"})), "fitted.yaml");
  EXPECT_EQ(one.rig.motor.inertia, 90);
  EXPECT_EQ(one.rig.motor.coulomb_friction, 22);
  EXPECT_EQ(one.rig.motor.coulomb_asymmetry, -2);
}

// 2 +- 5 N m s/rad, by +-3 more and less in the directions: the file holds 4 and 0.
TEST(FittedRig, NoDirectionHasFrictionBelowZero) {
  model::Rig rig = test::other_servo();
  rig.link.viscous_damping = 2;
  rig.link.viscous_asymmetry = 3;
  const rig_file::RigFile servo = test::servo_file();
  const rig_file::RigFile fitted =
      rig_file::rig_file_from_text(fitted_rig_text(servo, found_as(rig, {"load_viscous"})), "fitted.yaml");
  EXPECT_EQ(fitted.rig.link.viscous_damping, 2);
  EXPECT_EQ(fitted.rig.link.viscous_asymmetry, 2);
}

TEST(FittedRig, MotorSideFilesGetMotorSideValues) {
  rig_file::RigFile declared = test::servo_file();
  std::string text = declared.text;
  text.replace(text.find("  motor:"), 0, "  motor_side: true\n");
  declared = rig_file::rig_file_from_text(text, "motor_side.yaml");
  const rig_file::RigFile fitted = rig_file::rig_file_from_text(
      fitted_rig_text(declared, found_as(test::other_servo(), {"motor_inertia", "motor_coulomb"})),
      "fitted.yaml");
  EXPECT_NEAR(fitted.rig.motor.inertia, 7.8 / (110 * 110), 1e-9);  // six digits
  EXPECT_NEAR(fitted.rig.motor.coulomb_friction, 47.0 / 110, 1e-6);
}

}  // namespace
}  // namespace backlash::identification
