// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/record/channel_map.h"

namespace backlash::record {
namespace {

ChannelMap elbow() {
  ChannelMap map;
  map.joint = "elbow";
  map.declared = true;
  map.sources = {{Channel::motor_torque, "joint_states", "elbow_joint", Field::effort, 11.7, 0},
                 {Channel::motor_position, "drives", "elbow_joint", Field::position, 1, 0},
                 {Channel::load_position, "encoders", "elbow", Field::position, -1, 0.3}};
  return map;
}

TEST(ChannelMap, TheTopicOfTheMotorsPositionLeads) {
  EXPECT_EQ(elbow().topics(), (std::vector<std::string>{"drives", "joint_states", "encoders"}));
  ASSERT_EQ(elbow().on("encoders").sources.size(), 1u);
  EXPECT_EQ(elbow().on("encoders").sources.front().scale, -1);
  EXPECT_TRUE(elbow().on("elsewhere").sources.empty());
}

TEST(ChannelMap, UsualNamesCoverEveryChannelOnce) {
  const ChannelMap map = usual_channels("knee");
  EXPECT_NO_THROW(check(map));
  EXPECT_EQ(map.sources.size(), kChannelCount);
  EXPECT_EQ(map.topics(), std::vector<std::string>{"joint_states"});
  EXPECT_FALSE(map.declared);
  EXPECT_EQ(map.sources.front().name, "knee_motor");
}

TEST(ChannelMap, RefusesWhatCannotBeRead) {
  const auto refused = [](const ChannelMap& map) { EXPECT_THROW(check(map), InvalidParameter); };
  EXPECT_NO_THROW(check(elbow()));
  ChannelMap map = elbow();
  map.sources[1].channel = Channel::motor_torque;  // twice
  refused(map);
  map = elbow();
  for (const double scale : {0.0, kNaN, std::numeric_limits<double>::infinity()}) {
    map.sources[0].scale = scale;
    refused(map);
  }
  map = elbow();
  map.sources[2].offset = kNaN;
  refused(map);
  map = elbow();
  map.sources[0].name = "";
  refused(map);
  map = elbow();
  map.sources[0].topic = "";
  refused(map);
  map.sources = {{Channel::reference_position, "joint_states", "elbow", Field::position, 1, 0}};
  refused(map);  // shows no backlash
}

}  // namespace
}  // namespace backlash::record
