// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/channels.h"

namespace backlash::record {
namespace {

ChannelMap parse(const std::string& text) {
  const YamlReader yaml = YamlReader::from_text(text, "rig.yaml");
  const ChannelMap map = read_channels(yaml, "elbow");
  yaml.finish();
  return map;
}

TEST(Channels, AreReadWithTheirDefaults) {
  const ChannelMap map = parse(
      "channels:\n"
      "  motor_position: {name: elbow_joint}\n"
      "  motor_torque: {name: elbow_joint, scale: 11.7}\n"
      "  motor_current: {name: elbow_joint, field: velocity, offset: 0.5}\n"
      "  load_position: {topic: /link/encoders, name: elbow, scale: -1}\n");
  EXPECT_TRUE(map.declared);
  ASSERT_EQ(map.sources.size(), 4u);  // in the order of the channels
  EXPECT_EQ(map.sources[0].channel, Channel::motor_torque);
  EXPECT_EQ(map.sources[0].field, Field::effort);
  EXPECT_EQ(map.sources[0].scale, 11.7);
  EXPECT_EQ(map.sources[1].topic, "joint_states");
  EXPECT_EQ(map.sources[1].field, Field::position);
  EXPECT_EQ(map.sources[2].topic, "/link/encoders");
  EXPECT_EQ(map.sources[3].field, Field::velocity);
  EXPECT_EQ(map.sources[3].offset, 0.5);
}

TEST(Channels, AreThoseOfThisPackageWhereNoneAreGiven) {
  const ChannelMap map = parse("{}\n");
  EXPECT_FALSE(map.declared);
  EXPECT_EQ(map.sources.front().name, "elbow_motor");
}

TEST(Channels, MayBeColumnsOfACsv) {
  const ChannelMap map = parse(
      "channels:\n"
      "  time: {column: \"t [ms]\"}\n"
      "  motor_position: {column: Encoder, unit: deg, scale: -1, offset: 0.5}\n"
      "  load_position: {column: Out, unit: deg, name: elbow}\n");
  EXPECT_TRUE(map.declared);  // for messages: load_position alone
  ASSERT_EQ(map.sources.size(), 1u);
  EXPECT_EQ(map.sources[0].channel, Channel::load_position);
  EXPECT_EQ(map.time.column, "t [ms]");
  ASSERT_EQ(map.columns.size(), 2u);
  EXPECT_EQ(map.columns[0].column, "Encoder");
  EXPECT_EQ(map.columns[0].unit, "deg");
  EXPECT_EQ(map.columns[0].scale, -1.0);
  EXPECT_EQ(map.columns[0].offset, 0.5);
  EXPECT_FALSE(map.columns[1].scale.has_value());

  const ChannelMap columns_only =
      parse("channels:\n  time: {column: t, unit: s}\n  motor_position: {column: x, unit: rad}\n");
  EXPECT_FALSE(columns_only.declared);  // messages have the names of this package
  EXPECT_EQ(columns_only.sources.front().name, "elbow_motor");
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
  const std::string time = "channels:\n  time: {column: t, unit: s}\n  motor_position: ";
  EXPECT_EQ(refusal(time + "{column: x, unit: furlong}\n")
                .find("rig.yaml:3: channels.motor_position.unit = furlong: unknown, known are s, "),
            0u);
  EXPECT_NE(refusal(time + "{column: x, unit: Nm}\n").find("a torque, expected an angle"), std::string::npos);
  EXPECT_NE(refusal(time + "{column: t, unit: rad}\n").find("is the column with the time"),
            std::string::npos);
  EXPECT_NE(refusal(time + "{column: x, unit: rad, scale: 0}\n").find("must be finite and not 0"),
            std::string::npos);
  EXPECT_NE(refusal(time + "{column: x, unit: rad, topic: a}\n").find("motor_position.topic"),
            std::string::npos);
  EXPECT_NE(refusal(time + "{column: x, unit: rad, name: a, scale: 2}\n").find("motor_position.scale"),
            std::string::npos);
  EXPECT_NE(refusal(time + "{name: x}\n").find("channels"), std::string::npos);  // a time, and no column
  EXPECT_NE(refusal("channels:\n  motor_position: {column: x, unit: rad}\n").find("time"), std::string::npos);
  EXPECT_NE(refusal("channels:\n  time: {column: t, unit: s, scale: 2}\n").find("channels"),
            std::string::npos);
  EXPECT_NE(refusal("channels: 3\n").find("rig.yaml:1: channels = 3"), std::string::npos);
}

}  // namespace
}  // namespace backlash::record
