// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "backlash_diagnosis/identification/identify.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/simulation/simulation.h"

namespace backlash::identification {
namespace {

/// The rig of Sarkar et al. as declared but for 80 um of play, whose motor's torque is recorded as `factor`
/// of what it is.
Identification of_rig(double factor) {
  rig_file::RigFile file = rig_file::default_rig_file();
  file.rig.mesh.backlash = 80e-6;
  simulation::SensorsSettings& sensors = file.simulation.sensors;
  sensors.of(record::Channel::sensor_torque).noise = 2e-3;
  sensors.of(record::Channel::motor_position).resolution = 1e-6;
  record::Record record = simulation::simulate_record(file.rig, file.simulation, 2);
  for (double& torque : record.column(record::Channel::motor_torque)) torque *= factor;
  return commission(rig_file::default_rig_file(), {record});
}

bool names_the_sensor(const Identification& found) {
  return std::any_of(found.warnings.begin(), found.warnings.end(),
                     [](const std::string& warning) { return warning.find("the torque sensor reads") == 0; });
}

double errors_off(const Identification& found, const char* name, double truth) {
  const signal::Measured& p = found.parameters.at(name);
  return std::abs(p.value - truth) / p.standard_error;
}

// Angles show the ratio of the two torques and not which of them is wrong: of a motor's torque that is 12 %
// too large, all that is estimated with it is as well.
TEST(Commission, ErrorsHoldEitherTorqueThatDisagrees) {
  const model::Rig rig = rig_file::default_rig_file().rig;
  const Identification right = of_rig(1), wrong = of_rig(1.12);
  EXPECT_FALSE(names_the_sensor(right));
  EXPECT_TRUE(names_the_sensor(wrong));
  for (const Identification* found : {&right, &wrong}) {
    EXPECT_LT(errors_off(*found, "motor_inertia", rig.motor.inertia), 3);
    EXPECT_LT(errors_off(*found, "sensor_stiffness", rig.input_coupling.stiffness), 3);
    EXPECT_LT(errors_off(*found, "backlash", 80e-6), 3);
  }
  EXPECT_NEAR(wrong.parameters.at("motor_inertia").value, 1.12 * rig.motor.inertia, 0.02 * rig.motor.inertia);
  EXPECT_LT(right.parameters.at("motor_inertia").standard_error, 0.01 * rig.motor.inertia);
}

// The play is reported no finer than the interval of `waveform`: +-0.6 um.
TEST(Commission, PlayIsAsUncertainAsTheDiagnosisSays) {
  EXPECT_GE(of_rig(1).parameters.at("backlash").standard_error, 0.6e-6 / 1.96);
}

}  // namespace
}  // namespace backlash::identification
