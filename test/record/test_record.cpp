// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::record {
namespace {

Record small_record() {
  Record record;
  record.name = "run.csv";
  record.warnings = {"1 time gap"};
  record.time = {0, 1, 2, 3, 10};
  record.column(Channel::motor_torque) = {5, 6, 7, 8, 9};
  record.column(Channel::load_position) = {-5, -6, -7, -8, -9};
  return record;
}

TEST(Record, ChannelNamesAreTheColumnNamesAndInvertible) {
  EXPECT_EQ(channel_name(Channel::motor_torque), "motor_torque");
  EXPECT_EQ(channel_name(Channel::motor_position), "motor_position");
  EXPECT_EQ(channel_name(Channel::motor_velocity), "motor_velocity");
  EXPECT_EQ(channel_name(Channel::load_position), "load_position");
  EXPECT_EQ(channel_name(Channel::load_velocity), "load_velocity");
  EXPECT_EQ(channel_name(Channel::sensor_torque), "sensor_torque");
  EXPECT_EQ(channel_name(Channel::reference_position), "reference_position");
  EXPECT_EQ(channel_name(Channel::motor_current), "motor_current");
  EXPECT_EQ(channel_name(Channel::acceleration), "acceleration");
  EXPECT_EQ(channel_name(Channel::output_torque), "output_torque");
  std::set<std::string> names;
  for (const Channel channel : kChannels) {
    EXPECT_EQ(channel_from_name(channel_name(channel)), channel);
    names.insert(channel_name(channel));
  }
  EXPECT_EQ(names.size(), kChannelCount);
}

TEST(Record, ChannelsHaveTheUnitsOfARotaryAxis) {
  EXPECT_STREQ(channel_unit(Channel::motor_torque), "N m");
  EXPECT_STREQ(channel_unit(Channel::sensor_torque), "N m");
  EXPECT_STREQ(channel_unit(Channel::output_torque), "N m");
  EXPECT_STREQ(channel_unit(Channel::load_position), "rad");
  EXPECT_STREQ(channel_unit(Channel::motor_velocity), "rad/s");
  EXPECT_STREQ(channel_unit(Channel::motor_current), "A");
  EXPECT_STREQ(channel_unit(Channel::acceleration), "rad/s^2");
}

TEST(Record, NeedsAnyTorquePositionMotorSpeedCurrentOrAcceleration) {
  for (const Channel channel : kChannels) {
    Record record;
    record.time = {0};
    record.column(channel) = {1};
    const bool load_rate_or_reference =
        channel == Channel::load_velocity || channel == Channel::reference_position;
    EXPECT_EQ(record.can_show_backlash(), !load_rate_or_reference) << channel_name(channel);
  }
  EXPECT_FALSE(Record().can_show_backlash());
}

TEST(Record, UnknownChannelIsNamedWithTheKnownOnes) {
  try {
    channel_from_name("torque");
    FAIL() << "accepted an unknown channel";
  } catch (const InvalidParameter& error) {
    EXPECT_EQ(error.value(), "torque");
    EXPECT_NE(error.limit().find("sensor_torque"), std::string::npos) << error.limit();
  }
  EXPECT_THROW(channel_from_name(""), InvalidParameter);
  EXPECT_THROW(channel_from_name("time"), InvalidParameter);
}

TEST(Record, KnowsItsChannelsAndSize) {
  const Record record = small_record();
  EXPECT_EQ(record.size(), 5u);
  EXPECT_TRUE(record.has(Channel::motor_torque));
  EXPECT_FALSE(record.has(Channel::motor_position));
  EXPECT_EQ(record.column(Channel::motor_position).size(), 0u);
}

TEST(Record, SamplingIntervalIsTheMedianSoThatAGapDoesNotCount) {
  EXPECT_EQ(small_record().sampling_interval(), 1);
  EXPECT_EQ(Record().sampling_interval(), 0);
}

TEST(Record, SliceKeepsFromUpToButNotTo) {
  const Record part = small_record().slice(1, 3);
  EXPECT_EQ(part.time, (std::vector<double>{1, 2}));
  EXPECT_EQ(part.column(Channel::motor_torque), (std::vector<double>{6, 7}));
  EXPECT_EQ(part.column(Channel::load_position), (std::vector<double>{-6, -7}));
  EXPECT_FALSE(part.has(Channel::motor_position));
  EXPECT_EQ(part.name, "run.csv");
  EXPECT_EQ(part.warnings, (std::vector<std::string>{"1 time gap"}));
}

TEST(Record, SliceKnowsWhereTheRecordingBegan) {
  Record record = small_record();
  const double begin = record.time.front();
  EXPECT_EQ(record.start(), 0);
  EXPECT_EQ(record.slice(1, 3).start(), 1 - begin);
  EXPECT_EQ(record.slice(1, 100).slice(2, 3).start(), 2 - begin);
  EXPECT_EQ(std::move(record).slice(2, 100).start(), 2 - begin);
}

TEST(Record, SliceOutsideOrReversedIsEmpty) {
  const Record record = small_record();
  EXPECT_EQ(record.slice(-1, 100).size(), 5u);
  EXPECT_EQ(record.slice(11, 100).size(), 0u);
  EXPECT_EQ(record.slice(-5, 0).size(), 0u);
  EXPECT_EQ(record.slice(3, 1).size(), 0u);
  EXPECT_EQ(record.slice(3, 3).size(), 0u);
  EXPECT_EQ(Record().slice(0, 1).size(), 0u);
}

TEST(Record, SliceRefusesColumnsOfUnequalLength) {
  Record record = small_record();
  record.column(Channel::motor_torque).pop_back();
  try {
    record.slice(0, 1);
    FAIL() << "accepted a column that is too short";
  } catch (const BadData& error) {
    EXPECT_STREQ(error.what(), "run.csv: motor_torque has 4 values, time has 5");
  }
}

}  // namespace
}  // namespace backlash::record
