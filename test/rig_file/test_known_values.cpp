// SPDX-License-Identifier: BSD-3-Clause
// Uncertainties in a rig file. The oracle is what is written into the text.
#include <gtest/gtest.h>

#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/known_values.h"
#include "support/data.h"

namespace backlash::rig_file {
namespace {

/// The default rig file with another text in place of one that it has.
std::string with(const std::string& old, const std::string& put) {
  std::string text = default_rig_file().text;
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return text.replace(at, old.size(), put);
}

diagnosis::WaveformSettings waveform_of(const std::string& text) {
  return *rig_file_from_text(text, "rig.yaml").diagnosis.waveform;
}

TEST(KnownValues, AsTheFileSays) {
  const auto relative = waveform_of(
      with("viscous_damping: 0.0048", "viscous_damping: {value: 0.0048, uncertainty: 30 %, source: sheet}"));
  EXPECT_DOUBLE_EQ(relative.motor_damping, 0.0048);
  EXPECT_DOUBLE_EQ(relative.spread.motor_damping, 0.3);
  const auto absolute =
      waveform_of(with("viscous_damping: 0.0048", "viscous_damping: {value: 0.0048, uncertainty: 0.0012}"));
  EXPECT_DOUBLE_EQ(absolute.spread.motor_damping, 0.25);
  const auto nothing = waveform_of(default_rig_file().text);
  EXPECT_DOUBLE_EQ(nothing.spread.motor_damping, diagnosis::WaveformSpread().motor_damping);
}

TEST(KnownValues, OfTheBacklash) {
  const RigFile file =
      rig_file_from_text(with("half_gap: 0.0 ", "half_gap: {value: 2e-5, uncertainty: 2 %} "), "rig.yaml");
  EXPECT_DOUBLE_EQ(file.rig.mesh.backlash, 4e-5);
  EXPECT_DOUBLE_EQ(file.backlash_error.value(), 0.02);
  EXPECT_FALSE(default_rig_file().backlash_error);
}

TEST(KnownValues, RefusedWithLineAndValue) {
  for (const char* bad : {"-30 %", "0", "0 %", "30 percent", "1e999", "'30 %'", "[1]"}) {
    const std::string text =
        with("viscous_damping: 0.0048",
             std::string("viscous_damping: {value: 0.0048, ") + "uncertainty: " + bad + "}");
    try {
      rig_file_from_text(text, "rig.yaml");
      ADD_FAILURE() << bad;
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find("motor.viscous_damping.uncertainty"), std::string::npos)
          << error.what();
      EXPECT_NE(std::string(error.what()).find("rig.yaml:14"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(waveform_of(with("rate: 1000", "rate: {value: 1000, uncertainty: 1 %}")), BadData);
  EXPECT_THROW(waveform_of(with("half_gap: 0.0 ", "half_gap: {value: 0, uncertainty: 2 %} ")), BadData);
  EXPECT_THROW(waveform_of(with("0.0048 ", "{value: 0.0048, error: 2 %} ")), BadData);
}

TEST(KnownValues, WrittenAndReadBack) {
  const RigFile file = default_rig_file();
  diagnosis::WaveformCommissioning found;
  found.machine = *file.diagnosis.waveform;
  found.machine.motor_damping = 0.003, found.machine.spread.motor_damping = 0.02;
  found.machine.dry_friction = 0.001, found.machine.spread.dry_friction = 0.0002;
  found.machine.sensor_gain = 1.02, found.machine.spread.sensor_gain = 0.005;
  found.machine.common_scale = 0.05;
  found.undetermined = {"gear_inertia"};
  found.states.push_back({});
  found.states[0].backlash = 5e-5, found.states[0].log_error = 0.06;
  const std::string text = commissioned_text(file, found, "identified from a \"b\".csv");
  EXPECT_NE(text.find("  gear:\n    inertia: 2.1e-5   "), std::string::npos) << text;
  for (const std::string& each : {text, commissioned_text(rig_file_from_text(text, "x"), found, "c")}) {
    const RigFile read = rig_file_from_text(each, "rig.yaml");
    EXPECT_DOUBLE_EQ(read.rig.mesh.backlash, 5e-5);
    EXPECT_DOUBLE_EQ(read.backlash_error.value(), 0.06);
    const diagnosis::WaveformSettings& s = *read.diagnosis.waveform;
    EXPECT_DOUBLE_EQ(s.motor_damping, 0.003);
    EXPECT_DOUBLE_EQ(s.spread.motor_damping, 0.02);
    EXPECT_DOUBLE_EQ(s.dry_friction, 0.001);
    EXPECT_DOUBLE_EQ(s.spread.dry_friction, 0.0002);
    EXPECT_DOUBLE_EQ(s.sensor_gain, 1.02);
    EXPECT_DOUBLE_EQ(s.common_scale, 0.05);
    EXPECT_DOUBLE_EQ(s.spread.gear_inertia, diagnosis::WaveformSpread().gear_inertia);
  }
}

/// Behind a rigid coupling the link's value has the gear in it; a locked link has none that anybody uses.
TEST(KnownValues, OfAFreeLink) {
  const RigFile file = load_rig_file(test::package_file("config/sarkar_1997_free.yaml"));
  diagnosis::WaveformCommissioning found;
  found.machine = *file.diagnosis.waveform;
  const double gear = file.rig.gear.inertia;
  found.machine.common_scale = 0.05;
  EXPECT_DOUBLE_EQ(found.machine.link_inertia, gear + file.rig.link.inertia);
  found.machine.link_inertia = gear + 9e-5, found.machine.spread.link_inertia = 0.01;
  found.machine.link_damping = 0.003, found.machine.spread.link_damping = 0.02;
  found.machine.link_friction = 0.001, found.machine.spread.link_friction = 0.0002;
  found.machine.dry_friction = 0.001, found.machine.spread.dry_friction = 0.0002;
  found.states.push_back({});
  found.states[0].backlash = 5e-5, found.states[0].log_error = 0.06;
  const RigFile read = rig_file_from_text(commissioned_text(file, found, "identified"), "rig.yaml");
  EXPECT_DOUBLE_EQ(read.rig.gear.inertia, gear);
  EXPECT_DOUBLE_EQ(read.rig.link.inertia, 9e-5);
  EXPECT_DOUBLE_EQ(read.rig.link.viscous_damping, 0.003);
  EXPECT_DOUBLE_EQ(read.rig.link.coulomb_friction, 0.001);
  const diagnosis::WaveformSpread& spread = read.diagnosis.waveform->spread;
  EXPECT_NEAR(spread.link_inertia, 0.01, 1e-4);  // three digits are written
  EXPECT_DOUBLE_EQ(spread.link_damping, 0.02);
  EXPECT_DOUBLE_EQ(spread.link_friction, 0.0002);
}

}  // namespace
}  // namespace backlash::rig_file
