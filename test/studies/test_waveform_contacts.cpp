// SPDX-License-Identifier: BSD-3-Clause
// The estimator waveform on teeth of other exponents, on teeth that are springs and dampers, and on meshes of
// angles. The oracle is the simulation, which integrates the gear train by other code and another method.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "backlash_diagnosis/diagnosis/waveform.h"
#include "backlash_diagnosis/model/contact_law.h"
#include "backlash_diagnosis/rig_file/known_values.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/simulation/simulation.h"
#include "support/data.h"

namespace backlash::studies {
namespace {

using diagnosis::Estimate;
using diagnosis::Status;
using record::Channel;

std::string replaced(std::string text, const std::string& from, const std::string& before,
                     const std::string& by) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, text.find(before, at) - at, by);
}

rig_file::RigFile with_contact(const std::string& contact) {
  return rig_file::rig_file_from_text(
      replaced(rig_file::default_rig_file().text, "    contact:", "  gear:", contact), "contact.yaml");
}

/// The declared machine with values that are as far off as one spread and more, by its own law.
rig_file::RigFile off(rig_file::RigFile file, double backlash) {
  model::Rig& rig = file.rig;
  rig.motor.inertia *= 1.1, rig.pinion.inertia *= 0.9;
  rig.motor.viscous_damping *= 0.6;
  rig.input_coupling.stiffness *= 1.08, rig.input_coupling.damping *= 0.5;
  model::ContactSpec contact = rig.mesh.contact_spec();
  for (const char* key : {"stiffness", "alpha", "damping"})
    if (contact.values.has(key)) contact.values[key] *= 1.6;
  rig.mesh.contact = model::make_contact_law(contact.law, contact.values);
  rig.mesh.backlash = backlash;
  auto& sensors = file.simulation.sensors;
  sensors.sampling_rate = 2000;
  sensors.of(Channel::sensor_torque).noise = 0.001;
  sensors.of(Channel::motor_position).noise = 1e-6;
  return file;
}

record::Record record_of(const rig_file::RigFile& file) {
  return simulation::simulate_record(file.rig, file.simulation, 0.65).slice(0.2, 0.65);
}

record::Record without_position(record::Record record) {
  record.column(Channel::motor_position).clear();
  return record;
}

void expect_play(const rig_file::RigFile& declared, double backlash, double largest_error) {
  ASSERT_TRUE(declared.diagnosis.waveform);
  const record::Record record = record_of(off(declared, backlash));
  for (const bool position : {true, false}) {
    const Estimate e = diagnosis::estimate_waveform(position ? record : without_position(record),
                                                    *declared.diagnosis.waveform);
    ASSERT_EQ(e.status, Status::ok) << e.message;
    const bool angular = declared.rig.mesh.angular();
    EXPECT_LE(angular ? e.angle_lower : e.lower, backlash);
    EXPECT_GE(angular ? e.angle_upper : e.upper, backlash);
    EXPECT_EQ(std::isnan(e.backlash), angular);  // no radius, no length
    if (position) EXPECT_NEAR(angular ? e.backlash_angle : e.backlash, backlash, largest_error);
    // By theory 2.2 / sqrt(information of the priors on the scale): 12 to 15 % to either side.
    if (!position) EXPECT_LT(e.angle_upper - e.angle_lower, 0.32 * e.backlash_angle);
  }
}

/// The rig that meets the published skewness has an exponent of 1.362 and a soft output.
TEST(WaveformContacts, FittedRigOfThePaper) {
  const auto file = rig_file::load_rig_file(test::package_file("config/sarkar_1997_fitted.yaml"));
  ASSERT_TRUE(file.diagnosis.waveform);
  EXPECT_EQ(file.diagnosis.waveform->contact_exponent, 1.362);
  expect_play(file, 80e-6, 0.6e-6);  // what the interval promises at least
}

TEST(WaveformContacts, SpringAndDamper) {
  expect_play(with_contact("    contact: {law: linear, stiffness: 8.0e+5, damping: 60}\n"), 50e-6, 0.6e-6);
}

/// Teeth without any loss ring on and on, and windows are hard to start: estimated right or not at all.
TEST(WaveformContacts, NoLossAtAll) {
  const auto file = with_contact("    contact: {law: power_law, stiffness: 1.0e+7, exponent: 1.2}\n");
  ASSERT_TRUE(file.diagnosis.waveform);
  EXPECT_TRUE(std::isnan(file.diagnosis.waveform->contact_loss));
  const Estimate e = diagnosis::estimate_waveform(record_of(off(file, 20e-6)), *file.diagnosis.waveform);
  if (e.status == Status::out_of_domain) return;
  EXPECT_EQ(e.status, Status::ok) << e.message;
  EXPECT_LE(e.lower, 20e-6);
  EXPECT_GE(e.upper, 20e-6);
}

TEST(WaveformContacts, MeshOfAngles) {
  std::string text = replaced(rig_file::default_rig_file().text, "    base_radius:", "  gear:",
                              "    backlash_angle: 4.0e-3\n"
                              "    contact: {law: linear, stiffness: 180, damping: 0.013}\n");
  text = replaced(text, "  apd:", "  lost_motion:", "");
  text = replaced(text, "    backlash:\n", "      watch", "    backlash_angle:\n");
  expect_play(rig_file::rig_file_from_text(text, "angles.yaml"), 4e-3, 4e-5);
}

/// Teeth that are a spring and a damper beside those that are declared after Hertz: whatever the values, the
/// answer holds the play or there is none.
TEST(WaveformContacts, AnotherLawThanDeclaredIsNeverWrongAndSure) {
  const rig_file::RigFile declared = rig_file::default_rig_file();
  for (const double damping : {20.0, 200.0}) {
    rig_file::RigFile machine = off(declared, 50e-6);
    machine.rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", 8e5}, {"damping", damping}});
    const Estimate e = diagnosis::estimate_waveform(record_of(machine), *declared.diagnosis.waveform);
    if (e.status != Status::ok) continue;
    const double outside = std::max(e.lower - 50e-6, 50e-6 - e.upper);
    EXPECT_LT(outside, 2 * (e.upper - e.lower)) << damping << e.message;
  }
}

/// What is commissioned is written where the file has it, and read again.
TEST(WaveformContacts, CommissionedDamperIsWritten) {
  const rig_file::RigFile declared =
      with_contact("    contact:\n      law: linear\n      stiffness: 8.0e+5\n      damping: 60\n");
  const rig_file::RigFile machine = off(declared, 50e-6);
  const auto found = diagnosis::commission_waveform({record_of(machine)}, *declared.diagnosis.waveform);
  const rig_file::RigFile again =
      rig_file::rig_file_from_text(rig_file::commissioned_text(declared, found, "a test"), "again.yaml");
  const diagnosis::WaveformSettings &read = *again.diagnosis.waveform, &fit = found.machine;
  EXPECT_NEAR(read.contact_damping, fit.contact_damping, 1e-5 * fit.contact_damping);  // digits of the file
  EXPECT_NEAR(read.spread.contact_damping, fit.spread.contact_damping, 1e-2 * fit.spread.contact_damping);
  EXPECT_NEAR(std::log(read.contact_stiffness / 8e5), std::log(1.6), 3 * read.spread.contact_stiffness);
  EXPECT_NEAR(again.rig.mesh.backlash, 50e-6, 0.6e-6);
}

}  // namespace
}  // namespace backlash::studies
