// SPDX-License-Identifier: BSD-3-Clause
// Which procedures a set of records allows, and what is said about the others.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/fitted_rig.h"
#include "backlash_diagnosis/identification/identify.h"
#include "identification/procedures/procedures.h"
#include "support/servo.h"

namespace backlash::identification {
namespace {

record::Record square_wave(double duration) {
  record::Record record =
      simulation::simulate_record(test::servo_file().rig, test::servo_file().simulation, duration);
  record.name = "square.csv";
  return record;
}

const ProcedureReport& report(const Identification& found, const std::string& name) {
  return *std::find_if(found.procedures.begin(), found.procedures.end(),
                       [&](const ProcedureReport& p) { return p.name == name; });
}

TEST(Identify, SquareWaveAllowsDecayAndOutputError) {
  const Identification found = identify(test::servo_file().rig, {square_wave(6)});
  EXPECT_EQ(report(found, "output_error").records, std::vector<std::string>{"square.csv"});
  EXPECT_EQ(report(found, "decay").records, std::vector<std::string>{"square.csv"});
  for (const char* name : {"friction_lines", "line_inertia", "clearance", "gap_map"}) {
    EXPECT_TRUE(report(found, name).records.empty()) << name;
    EXPECT_FALSE(report(found, name).message.empty()) << name;
  }
  EXPECT_EQ(found.parameters.size(), 10u);
  EXPECT_EQ(found.units.at("mesh_stiffness"), "N m/rad");
}

// Linear teeth, as declared, leave several times the noise of a record of Hertzian ones, and play that is off
// by 3 to 7 of the errors that the record alone states. Three standard errors. The encoders' zeros may lie
// hundreds of gaps apart.
TEST(Identify, ErrorsHoldWhatHertzianTeethWouldBeEstimatedAs) {
  for (const auto& [gap, zero] : {std::pair{2e-4, 0.0}, {6e-4, 0.03}, {1.2e-3, -0.4}}) {
    model::Rig truth = test::other_servo();
    truth.mesh.backlash = gap;
    truth.mesh.contact =  // at 200 N m as stiff as linear teeth of 400e3 N m/rad, damped by 560 N m s/rad
        model::make_contact_law("hunt_crossley", {{"stiffness", 1.8e7}, {"exponent", 1.5}, {"alpha", 1.9}});
    record::Record record = simulation::simulate_record(truth, test::servo_run(1), 20);
    record.name = "hertz.csv";
    for (double& position : record.column(record::Channel::load_position)) position += zero;
    const Identification found = identify(test::servo_file().rig, {record});
    const signal::Measured play = found.parameters.at("backlash_angle");
    EXPECT_NEAR(play.value, gap, 3 * play.standard_error);
    EXPECT_LT(play.standard_error, 5e-4);  // the deflection of the teeth, under 200 N m
    EXPECT_TRUE(std::any_of(found.warnings.begin(), found.warnings.end(), [](const std::string& warning) {
      return warning.find("Hertzian teeth leave less") != std::string::npos;
    })) << gap;
  }
}

TEST(Identify, TakesALoadBehindAShaft) {
  const model::Rig rig = test::servo_behind_shaft(0.01);
  record::Record record = simulation::simulate_record(rig, test::servo_run(1), 2.5);
  EXPECT_EQ(identification_case(rig, {record}).names.size(), 11u);  // with output_stiffness
  model::Rig bearing_at_link = rig;
  bearing_at_link.bearing_at_gear = false;
  EXPECT_THROW(identification_case(bearing_at_link, {record}), CannotIdentify);
}

// With the shaft in the rig file, whose stiffness, play and inertia are 20 % off there.
TEST(Identify, ALoadBehindAShaft) {
  const model::Rig truth = test::servo_behind_shaft(0.01);
  record::Record record = simulation::simulate_record(truth, test::servo_run(1), 6);
  record.name = "shaft.csv";
  model::Rig declared = truth;
  declared.output_coupling.stiffness *= 1.2;
  declared.mesh.backlash *= 1.2;
  declared.link.inertia *= 0.8;
  const Identification found = identify(declared, {record});
  EXPECT_EQ(found.procedures.size(), 2u);  // none that knows two bodies only
  // The fit's gear has no mass: a tenth of the stiffnesses and inertias. The play is where it turns.
  for (const auto& [name, value] :
       {std::pair{"output_stiffness", 1.2e6}, {"mesh_stiffness", 400e3}, {"load_inertia", 84.0}})
    EXPECT_NEAR(found.parameters.at(name).value, value, 0.1 * value) << name;
  const signal::Measured play = found.parameters.at("backlash_angle");
  EXPECT_NEAR(play.value, truth.mesh.backlash, 3 * play.standard_error);
  EXPECT_LT(play.standard_error, 0.02 * truth.mesh.backlash);
}

TEST(Identify, ARecordOfTheMotorSideAloneShowsItsFriction) {
  // Speeds with their torque, as a drive without load encoder shows them: 63 + 13 w of the motor, 15 + 9 w of
  // the load.
  record::Record record;
  record.name = "speeds.csv";
  for (int k = 0; k < 40000; ++k) {
    const int run = k / 10000;
    const double t = k * 1e-3, speed = std::vector<double>{0.2, 0.8, -0.3, -1.0}[run];
    record.time.push_back(t);
    record.column(record::Channel::motor_velocity).push_back(speed + 1e-4 * std::sin(17.3 * k));
    record.column(record::Channel::motor_torque)
        .push_back((speed > 0 ? 78 : -78) + 22 * speed + std::sin(31.7 * k));
    record.column(record::Channel::motor_position).push_back(speed * (t - 10 * run));
  }
  const Identification found = identify(test::servo_file().rig, {record});
  EXPECT_EQ(report(found, "friction_lines").records.size(), 1u);
  EXPECT_TRUE(report(found, "output_error").records.empty());
  const auto& p = found.parameters;
  EXPECT_NEAR(p.at("motor_coulomb").value + p.at("load_coulomb").value, 78, 0.5);
  EXPECT_NEAR(p.at("motor_viscous").value + p.at("load_viscous").value, 22, 0.5);
  EXPECT_GT(p.at("motor_coulomb").standard_error, 1);  // how it is shared out is what the rig file declares
  EXPECT_EQ(p.count("mesh_stiffness"), 0u);
}

TEST(Identify, NothingToGoByIsSaidWithAllReasons) {
  record::Record record = square_wave(1);
  for (const record::Channel channel : {record::Channel::motor_position, record::Channel::motor_velocity})
    record.column(channel).clear();
  try {
    identify(test::servo_file().rig, {record});
    FAIL() << "nothing thrown";
  } catch (const CannotIdentify& error) {
    for (const char* name : {"friction_lines", "frequency_response", "output_error"})
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
  }
}

TEST(Identify, HolesAndGapsAreNamed) {
  record::Record hole = square_wave(3), gap = square_wave(3);
  hole.column(record::Channel::load_position)[1500] = std::nan("");
  for (std::size_t k = 1000; k < gap.size(); ++k) gap.time[k] += 0.5;
  for (const record::Record& bad : {hole, gap}) {
    EXPECT_THROW(identify(test::servo_file().rig, {bad}), BadData);
    const Identification found = identify(test::servo_file().rig, {bad, square_wave(3)});
    ASSERT_FALSE(found.warnings.empty());
    EXPECT_EQ(found.warnings.front().rfind("not used: square.csv", 0), 0u) << found.warnings.front();
  }
}

/// One sample of a hundred is lost, and twenty in a row.
record::Record with_losses(const record::Record& all) {
  std::vector<double> times;
  for (std::size_t k = 0; k < all.size(); ++k)
    if (k % 100 != 37 && (k < 3000 || k >= 3020)) times.push_back(all.time[k]);
  return record::samples_at(all, times);
}

// A lost sample costs a sample: the machine is the same, and lacks nothing.
TEST(Identify, LostSamplesAreNoMissingEffect) {
  const record::Record whole = square_wave(6);
  const Identification all = identify(test::servo_file().rig, {whole}),
                       some = identify(test::servo_file().rig, {with_losses(whole)});
  EXPECT_EQ(some.warnings, all.warnings);
  for (const auto& [name, value] : all.parameters) {
    const signal::Measured& with = some.parameters.at(name);
    EXPECT_NEAR(with.value, value.value, 2 * std::hypot(value.standard_error, with.standard_error)) << name;
    EXPECT_LT(with.standard_error, 1.5 * value.standard_error + 1e-12) << name;  // a fifth of the rows less
  }
}

// Gravity that the file does not declare is most of the torque: no value of such a fit is one of the
// machine's.
TEST(Identify, AMachineOfAnotherKindHasNoValues) {
  const rig_file::RigFile file = test::servo_file();
  record::Record record = simulation::simulate_record(file.rig, test::servo_run(1), 10);
  record.name = "pushed.csv";
  std::vector<double>& torque = record.column(record::Channel::motor_torque);
  for (std::size_t k = 0; k < record.size(); ++k) torque[k] += 2000 * std::sin(0.6 * M_PI * record.time[k]);
  const Identification found = identify(file.rig, {record});
  ASSERT_TRUE(found.unexplained) << found.channels.at("torque").error;
  EXPECT_GT(found.channels.at("torque").error, 0.5);
  for (const auto& [name, value] : found.parameters) EXPECT_TRUE(std::isinf(value.standard_error)) << name;
  const std::string text = fitted_rig_text(file, found);
  EXPECT_EQ(text, file.text);  // what was declared stays
}

TEST(Identify, CancelsAndRefusesOtherMachines) {
  const Progress cancel = [](double, const std::string&) { return false; };
  EXPECT_THROW(identify(test::servo_file().rig, {square_wave(1)}, cancel), Cancelled);
  const model::Rig locked = rig_file::load_rig_file(test::package_file("config/sarkar_1997.yaml")).rig;
  EXPECT_THROW(identify(locked, {square_wave(1)}), CannotIdentify);
}

}  // namespace
}  // namespace backlash::identification
