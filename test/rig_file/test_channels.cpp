// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/channels.h"

namespace backlash::rig_file {
namespace {

record::ChannelMap parse(const std::string& text) {
  const YamlReader yaml = YamlReader::from_text(text, "rig.yaml");
  const record::ChannelMap map = read_channels(yaml, "elbow");
  yaml.finish();
  return map;
}

TEST(Channels, AreReadWithTheirDefaults) {
  const record::ChannelMap map = parse(
      "channels:\n"
      "  motor_position: {name: elbow_joint}\n"
      "  motor_torque: {name: elbow_joint, scale: 11.7}\n"
      "  motor_current: {name: elbow_joint, field: velocity, offset: 0.5}\n"
      "  load_position: {topic: /link/encoders, name: elbow, scale: -1}\n");
  EXPECT_TRUE(map.declared);
  ASSERT_EQ(map.sources.size(), 4u);  // in the order of the channels
  EXPECT_EQ(map.sources[0].channel, record::Channel::motor_torque);
  EXPECT_EQ(map.sources[0].field, record::Field::effort);
  EXPECT_EQ(map.sources[0].scale, 11.7);
  EXPECT_EQ(map.sources[1].topic, "joint_states");
  EXPECT_EQ(map.sources[1].field, record::Field::position);
  EXPECT_EQ(map.sources[2].topic, "/link/encoders");
  EXPECT_EQ(map.sources[3].field, record::Field::velocity);
  EXPECT_EQ(map.sources[3].offset, 0.5);
}

TEST(Channels, AreThoseOfThisPackageWhereNoneAreTold) {
  const record::ChannelMap map = parse("{}\n");
  EXPECT_FALSE(map.declared);
  EXPECT_EQ(map.sources.front().name, "elbow_motor");
}

TEST(Channels, WrongOnesAreRefusedWithTheirPlace) {
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      parse(text);
    } catch (const BadData& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("channels:\n  motor_position: {topic: a}\n"),
            "rig.yaml:2: channels.motor_position.name: is missing, expected text");
  EXPECT_NE(refusal("channels:\n  motor_position: {name: a, field: torque}\n")
                .find("rig.yaml:2: channels.motor_position.field"),
            std::string::npos);
  EXPECT_NE(refusal("channels:\n  motor_positon: {name: a}\n").find("channels"), std::string::npos);
  EXPECT_NE(refusal("channels:\n  motor_position: {name: a, scale: 0}\n").find("must be finite and not 0"),
            std::string::npos);
  EXPECT_NE(refusal("channels: {}\n").find("must have a torque"), std::string::npos);
  EXPECT_NE(refusal("channels: 3\n").find("rig.yaml:1: channels = 3"), std::string::npos);
}

}  // namespace
}  // namespace backlash::rig_file
