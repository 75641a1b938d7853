// SPDX-License-Identifier: BSD-3-Clause
// The columns of an arm's joints: as the rig file says them, and still there in what a fit writes.
#include <gtest/gtest.h>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/base/error.h"
#include "support/data.h"

namespace backlash::arm {
namespace {

ArmRig lwr4() {
  return load_arm_rig(test::package_file("config/lwr4/lwr4.yaml"));
}

void expect_columns(const ArmRig& rig) {
  ASSERT_EQ(rig.joints.size(), 7u);
  EXPECT_EQ(rig.channel, record::Channel::output_torque);
  for (std::size_t j = 0; j < rig.joints.size(); ++j) {
    const record::ChannelMap& map = rig.joints[j].channels;
    EXPECT_EQ(map.time.column, "times");
    EXPECT_EQ(map.time.unit, "s");
    ASSERT_EQ(map.columns.size(), 3u);
    EXPECT_EQ(map.columns[1].channel, record::Channel::motor_velocity);
    EXPECT_EQ(map.columns[1].column, "velocities");
    EXPECT_EQ(map.columns[1].element, j + 1);
    EXPECT_EQ(map.columns[1].unit, "rad/s");
  }
}

TEST(ArmChannels, AreReadAndWrittenAgain) {
  const ArmRig rig = lwr4();
  expect_columns(rig);
  expect_columns(arm_rig_from_text(arm_rig_text(rig, {"fitted"}), "fitted.yaml", ""));
}

TEST(ArmChannels, OfAllJointsOrNoneWithPositionAndTorque) {
  const std::string text = arm_rig_text(lwr4(), {});
  const auto refused = [&](const std::string& line, const std::string& reason) {
    std::string changed = text;
    const auto at = changed.find(line);
    ASSERT_NE(at, std::string::npos);
    changed.erase(at, changed.find('\n', at) + 1 - at);
    try {
      arm_rig_from_text(changed, "rig.yaml", "");
      ADD_FAILURE() << "accepted without " << line;
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  };
  refused("      output_torque: {column: \"torques\", element: 4",
          "must say the column of output_torque for lwr_3_joint");
  refused("  time: {column", "channels");
}

}  // namespace
}  // namespace backlash::arm
