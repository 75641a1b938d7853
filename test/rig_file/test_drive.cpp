// SPDX-License-Identifier: BSD-3-Clause
// Parts of a drive by hand: 15:75 and 17:85 teeth are 25 turns of the motor per turn of the load, the shaft
// between turns 5 times; its teeth pass 15 * 25 = 375 and 17 * 5 = 85 times.
#include <gtest/gtest.h>

#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/drive.h"

namespace backlash::rig_file {
namespace {

Drive drive_of(const std::string& yaml, double otherwise = 110) {
  const YamlReader reader = YamlReader::from_text(yaml, "drive");
  Drive drive = read_drive(reader, otherwise);
  reader.finish();
  return drive;
}

const char* const kTwoStages =
    "pole_pairs: 4\nstages: [{driving: 15, driven: 75}, {driving: 17, driven: 85}]\n";

TEST(Drive, PartsTurnAsTheTeethSay) {
  std::map<std::string, double> parts;
  for (const TurningPart& part : turning_parts(drive_of(kTwoStages))) parts[part.name] = part.order;
  const std::map<std::string, double> expected = {
      {"once per turn of the load", 1},         {"once per motor turn", 25},
      {"once per pole pair of the motor", 100}, {"once per tooth of stage 1", 375},
      {"once per tooth of stage 2", 85},        {"once per turn of the shaft behind stage 1", 5}};
  ASSERT_EQ(parts.size(), expected.size());
  for (const auto& [name, order] : expected) EXPECT_NEAR(parts.at(name), order, 1e-9) << name;
}

TEST(Drive, RatioOfTheRigWhereItStatesNone) {
  EXPECT_EQ(drive_of("wave_generator: true\n").reduction_ratio, 110);
  const auto parts = turning_parts(drive_of("wave_generator: true\n"));
  EXPECT_EQ(parts.back().order, 220);
}

TEST(Drive, NamesThePartThatTurnsThatOften) {
  const Drive drive = drive_of("pole_pairs: 4\nreduction_ratio: 110\n");
  const std::string motor = part_of_order(drive, 109.9968, 0.0018);
  EXPECT_EQ(motor.rfind("once per motor turn, 110;", 0), 0u) << motor;
  EXPECT_NE(motor.find("once per pole pair of the motor, 440"), std::string::npos) << motor;
  EXPECT_EQ(part_of_order(drive, 220, 0.01).rfind("once per motor turn, 110 (multiple 2);", 0), 0u);
  EXPECT_EQ(part_of_order(drive, 280, 0.01).rfind("no part of the drive", 0), 0u);
  EXPECT_NE(part_of_order(drive, 440, 0.1).find(" or "), std::string::npos);
}

TEST(Drive, RefusesTeethThatContradictTheRatio) {
  EXPECT_THROW(drive_of("reduction_ratio: 24\n" + std::string(kTwoStages)), BadData);
  EXPECT_THROW(drive_of("stages: [{driving: 0, driven: 75}]\n"), BadData);
  EXPECT_THROW(drive_of("poles: 4\n"), BadData);
}

}  // namespace
}  // namespace backlash::rig_file
