// SPDX-License-Identifier: BSD-3-Clause
// Motor current and acceleration as the signal of the diagnosis, from rig file to answer.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/studies/curve_builder.h"
#include "support/data.h"

namespace backlash::studies {
namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto place = text.find(from);
  EXPECT_NE(place, std::string::npos) << from;
  return text.replace(place, from.size(), to);
}

/// config/sarkar_1997.yaml with changes, through the loader of rig files.
rig_file::RigFile rig(const std::string& sensors, const std::string& signal, const std::string& range,
                      const std::string& motor = "") {
  std::string text = rig_file::default_rig_file().text;
  text = replaced(text, "  sampling_rate: 1000 ", "  " + sensors + "\n  sampling_rate: 2000 ");
  text = replaced(text, "signal: sensor_torque", "signal: " + signal);
  text = replaced(text, "lower: -0.4 ", "lower: -" + range + " ");
  text = replaced(text, "upper: 0.4 ", "upper: " + range + " ");
  if (!motor.empty()) text = replaced(text, "  motor:\n", "  motor:\n    " + motor + "\n");
  const std::string path = ::testing::TempDir() + "/other_signal_" + std::to_string(::getpid()) + ".yaml";
  std::ofstream(path) << text;
  const rig_file::RigFile file = rig_file::load_rig_file(path);
  std::remove(path.c_str());
  return file;
}

CurveRequest coarse() {
  CurveRequest request;
  request.points = 11;
  request.periods = 5;
  request.seeds = 4;
  request.machines = 0;
  return request;
}

diagnosis::Estimate by_skewness(const rig_file::RigFile& file, const diagnosis::MonitoringCurve& curve,
                                double backlash, unsigned seed) {
  rig_file::RigFile machine = file;
  machine.rig.mesh.backlash = backlash;
  machine.simulation.sensors.seed = seed;
  const record::Record record = simulation::simulate_record(machine.rig, machine.simulation, 1.2);
  EXPECT_TRUE(record.has(file.diagnosis.apd->signal));
  return diagnosis::diagnose(record, file.diagnosis, &curve, std::nullopt, "apd_skewness").estimates.front();
}

// The gear's acceleration rings at 2.8 kHz behind the stiff output coupling, and its skewness has a dip at 50
// um: the curve needs a grid that shows it, and most intervals span branches. What they claim must be true
// all the same.
TEST(OtherSignals, AccelerationShowsBacklashOrIsRefused) {
  const rig_file::RigFile file = rig("acceleration: {noise: 5}", "acceleration", "1500");
  CurveRequest request = coarse();
  request.points = 21;
  const diagnosis::MonitoringCurve curve = build_curve(file, request);
  EXPECT_EQ(curve.conditions.signal, "acceleration");
  EXPECT_EQ(curve.conditions.noise, 5);
  EXPECT_FALSE(curve.flat());
  // 30 % of the signal's rms. Of that: contact and excitation torque on the gear, of the order of 0.05 N m on
  // 2.1e-5 kg m^2, during the impacts; 50 to 2000 rad/s^2 is what a curve in the wrong unit would miss by
  // far.
  EXPECT_GT(curve.noise_levels.back(), 0.3 * 50);
  EXPECT_LT(curve.noise_levels.back(), 0.3 * 2000);
  int informative = 0;
  for (const double backlash : {0.0, 2e-5, 5e-5, 7e-5, 9e-5, 1.3e-4}) {
    const diagnosis::Estimate e = by_skewness(file, curve, backlash, 3);
    if (e.status != diagnosis::Status::ok) continue;
    ++informative;
    EXPECT_LE(e.lower, backlash) << e.message;
    EXPECT_GE(e.upper, backlash) << e.message;
    EXPECT_LT(e.upper - e.lower, 1e-4) << e.message;  // half of the curve is the definition of ambiguous
  }
  EXPECT_GE(informative, 4);  // of 60 values in a separate run 41 were, and none was wrong
}

TEST(OtherSignals, ACommandedCurrentHasNoAnswer) {
  const rig_file::RigFile file =
      rig("motor_current: {noise: 0.01}", "motor_current", "5", "torque_constant: 0.02");
  const diagnosis::MonitoringCurve curve = build_curve(file, coarse());
  EXPECT_TRUE(curve.flat());
  EXPECT_DOUBLE_EQ(curve.noise_levels.back(), 0.3 * 0.05 / 0.02);  // 30 % of the square wave's rms, in A
  for (const double backlash : {0.0, 5e-5, 1.3e-4, 2e-4}) {
    const diagnosis::Estimate e = by_skewness(file, curve, backlash, 3);
    EXPECT_EQ(e.status, diagnosis::Status::ambiguous) << e.message;
    EXPECT_NE(e.message.find("motor_current does not depend on backlash"), std::string::npos) << e.message;
    EXPECT_TRUE(std::isnan(e.backlash) && std::isnan(e.upper));
  }
}

TEST(OtherSignals, ACurrentNeedsItsTorqueConstant) {
  EXPECT_THROW(rig("motor_current: {noise: 0.01}", "motor_current", "5"), BadData);
  const rig_file::RigFile undeclared = rig("sensor_torque: {noise: 0}", "motor_current", "5");
  try {
    build_curve(undeclared, coarse());
    ADD_FAILURE() << "built";
  } catch (const InvalidParameter& error) {
    EXPECT_NE(std::string(error.what()).find("torque_constant"), std::string::npos) << error.what();
  }
}

TEST(OtherSignals, MessagesNameTheUnitOfTheSignal) {
  const rig_file::RigFile file = rig("acceleration: {noise: 5}", "acceleration", "1500");
  CurveRequest request = coarse();
  request.points = 3;
  const diagnosis::MonitoringCurve curve = build_curve(file, request);
  rig_file::RigFile loud = file;
  loud.simulation.sensors.of(record::Channel::acceleration).noise = 2 * curve.noise_levels.back();
  const diagnosis::Estimate e = by_skewness(loud, curve, 5e-5, 3);
  EXPECT_EQ(e.status, diagnosis::Status::out_of_domain);
  EXPECT_NE(e.message.find("rad/s^2"), std::string::npos) << e.message;
}

}  // namespace
}  // namespace backlash::studies
