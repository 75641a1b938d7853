// SPDX-License-Identifier: BSD-3-Clause
// A torque-sensor rig that gets more play while it runs, by the simulation: other code and another method
// than the fit. `change_study --rig` does the same with many machines and changes.
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/changes/changes_of_rig.h"
#include "support/changing_rig.h"

namespace backlash::changes {
namespace {

constexpr double kOnset = 14, kDuration = 36;  // s

/// Values off by some tenths from the file's, which is what the estimator may take for known.
rig_file::RigFile machine() {
  rig_file::RigFile file = rig_file::default_rig_file();
  file.rig.mesh.backlash = 5e-5;
  file.rig.motor.inertia *= 1.1, file.rig.motor.viscous_damping *= 1.3;
  file.rig.input_coupling.stiffness *= 0.95;
  test::scale_contact(file.rig, "stiffness", 1.3);
  file.simulation.sensors.of(record::Channel::sensor_torque).noise = 5e-4;
  file.simulation.sensors.of(record::Channel::motor_position).noise = 3e-6;
  return file;
}

/// As few fits as can be.
ChangeSettings quick() {
  ChangeSettings settings;
  settings.rig_healthy_stretches = 4, settings.rig_stretches = 6, settings.rig_refinements = 4;
  return settings;
}

record::Record healthy() {
  record::Record r = test::settled(machine(), 8);
  r.name = "monday";
  return r;
}

std::string refusal(const rig_file::RigFile& file, const record::Record& healthy,
                    const record::Record& record) {
  try {
    detect_changes(file, {healthy}, record, quick());
  } catch (const CannotIdentify& error) {
    return error.what();
  }
  return "";
}

TEST(ChangesOfRig, MorePlayIsReported) {
  rig_file::RigFile file = machine();
  file.simulation.sensors.seed = 2;
  const record::Record record = test::changing_record(file, kDuration, {"backlash", 0.2}, kOnset);
  const Changes found = detect_changes(rig_file::default_rig_file(), {healthy()}, record, quick());
  ASSERT_EQ(found.changes.size(), 1u);
  const Change& c = found.changes[0];
  EXPECT_EQ(c.effect, "backlash");
  EXPECT_TRUE(c.alike.empty());
  EXPECT_LE(c.since_from, kOnset);
  EXPECT_GE(c.since_to, kOnset);
  ASSERT_EQ(c.size.size(), 2u);
  EXPECT_EQ(c.size[0].name, "backlash");
  EXPECT_EQ(c.size[0].unit, "m");
  // `waveform` estimates a play within 0.6 um; an angle is that over the base radius.
  EXPECT_NEAR(c.size[0].measured.value, 1e-5, 0.6e-6);
  EXPECT_NEAR(c.size[0].measured.value, 1e-5, 2 * c.size[0].measured.standard_error);
  EXPECT_NEAR(c.size[1].measured.value * file.rig.mesh.base_radius, c.size[0].measured.value, 1e-12);
  EXPECT_FALSE(c.until);
  EXPECT_TRUE(found.cannot_tell.empty()) << found.cannot_tell;
}

TEST(ChangesOfRig, WhatCannotBeServedIsRefusedWithTheReason) {
  const record::Record good = healthy();
  record::Record still = good, blind = good;
  for (double& t : still.column(record::Channel::motor_torque)) t = 0.05;
  blind.column(record::Channel::sensor_torque).clear();
  const rig_file::RigFile file = rig_file::default_rig_file();
  EXPECT_NE(refusal(file, good, blind).find("needs sensor_torque"), std::string::npos);
  EXPECT_NE(refusal(file, still, good).find("nowhere eight reversals"), std::string::npos);
  const std::string configs = BACKLASH_DIAGNOSIS_SOURCE_DIR "/config/";
  EXPECT_NE(refusal(rig_file::load_rig_file(configs + "cycloidal.yaml"), good, good).find("no torque sensor"),
            std::string::npos);
  EXPECT_NE(refusal(rig_file::load_rig_file(configs + "sarkar_1997_turning.yaml"), good, good)
                .find("its equations"),
            std::string::npos);
}

}  // namespace
}  // namespace backlash::changes
