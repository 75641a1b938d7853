// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/String.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "bag_record_test.h"

namespace backlash::ros_bridge {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

TEST_F(BagRecord, AllChannelsAndTimesSurviveExactly) {
  const record::Record record = sample_record();
  write_bag(record, file("a.bag"), "elbow");
  const record::Record read = read_bag(file("a.bag"));
  // 0.0020000005 is between two nanoseconds; the stamp is the nearest one.
  EXPECT_EQ(read.time, (std::vector<double>{0, 0.001, 0.002000001, 0.003, 17}));
  expect_same_columns(read, record);
  EXPECT_TRUE(std::signbit(read.column(record::Channel::motor_torque)[1]));
  EXPECT_EQ(read.name, file("a.bag"));
  EXPECT_EQ(files(), 1u);  // no temporary file stays
}

TEST_F(BagRecord, TimesThatDoNotStartAtZeroSurvive) {
  // The last: a decimal of more than 2^53 nanoseconds, whose double is coarser than a nanosecond.
  for (const std::vector<double>& time :
       {std::vector<double>{1234.567891234, 1234.567892, 1235.1}, std::vector<double>{-2.5, -0.25, 3.125},
        std::vector<double>{1700000000.25, 1700000000.251, 1700000001}}) {
    const record::Record record = sample_record(time);
    write_bag(record, file("a.bag"), "joint");
    EXPECT_EQ(read_bag(file("a.bag")).time, time);
  }
}

TEST_F(BagRecord, EveryMillisecondOfAnHourIsTheDoubleOfItsDecimal) {
  std::vector<double> time;
  for (int i = 0; i < 3600; ++i)
    time.push_back(std::stod(std::to_string(i) + "." + std::to_string(100 + i % 900)));
  write_bag(sample_record(time), file("a.bag"), "joint");
  EXPECT_EQ(read_bag(file("a.bag")).time, time);
}

TEST_F(BagRecord, StampsAreTheOriginPlusTime) {
  write_bag(sample_record({0, 0.5}), file("a.bag"), "joint", ros::Time(5, 250000000));
  rosbag::Bag bag(file("a.bag"));
  rosbag::View view(bag, rosbag::TopicQuery("/joint_states"));
  ASSERT_EQ(view.size(), 2u);
  const auto last = (++view.begin())->instantiate<sensor_msgs::JointState>();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->header.stamp, ros::Time(5, 750000000));
  EXPECT_EQ((++view.begin())->getTime(), ros::Time(5, 750000000));
  rosbag::View info(bag, rosbag::TopicQuery("/record_info"));
  ASSERT_EQ(info.size(), 1u);
  EXPECT_TRUE(info.begin()->isLatching());
}

TEST_F(BagRecord, RecordedBagBeginsAtZeroAndOnlyHeaderStampsCount) {
  Recording(file("a.bag"))
      .add(Recording::motor(50.25, 1))
      .add(Recording::motor(50.5, 2))
      .add(Recording::motor(51, 3));
  const record::Record record = read_bag(file("a.bag"));
  EXPECT_EQ(record.time, (std::vector<double>{0, 0.25, 0.75}));
  EXPECT_EQ(record.column(record::Channel::motor_position), (std::vector<double>{1, 2, 3}));
  EXPECT_FALSE(record.has(record::Channel::sensor_torque));
}

TEST_F(BagRecord, ChannelThatIsNanThroughoutIsAbsent) {
  Recording(file("a.bag")).add(Recording::motor(1, 1, kNan)).add(Recording::motor(2, 2, kNan));
  const record::Record record = read_bag(file("a.bag"));
  EXPECT_FALSE(record.has(record::Channel::motor_velocity));
  EXPECT_TRUE(record.has(record::Channel::motor_torque));
}

TEST_F(BagRecord, ChannelThatIsNanAtTimesIsPassedOn) {
  Recording(file("a.bag"))
      .add(Recording::motor(1, 1, kNan))
      .add(Recording::motor(2, 1, 7))
      .add(Recording::motor(3, 1, kNan));
  const record::Record record = read_bag(file("a.bag"));
  const std::vector<double>& speed = record.column(record::Channel::motor_velocity);
  ASSERT_EQ(speed.size(), 3u);
  EXPECT_TRUE(std::isnan(speed[0]) && std::isnan(speed[2]));
  EXPECT_EQ(speed[1], 7);
}

TEST_F(BagRecord, StampThatGoesBackIsRefused) {
  Recording(file("a.bag")).add(Recording::motor(1)).add(Recording::motor(2)).add(Recording::motor(1.5));
  const std::string message = message_of<BadData>([&] { read_bag(file("a.bag")); });
  for (const char* part : {"/joint_states message 2", "1.500000000", "2.000000000", "merged"})
    expect_contains(message, part);
}

// As of a loop, or of a clock that was set: what comes later has its place in the record, behind a gap.
TEST_F(BagRecord, StampsThatBeginAgainCountOn) {
  {
    Recording recording(file("a.bag"));
    for (int k = 0; k < 40; ++k) recording.add(Recording::motor(5 + 0.25 * (k % 20), k));
  }
  const record::Record record = read_bag(file("a.bag"));
  ASSERT_EQ(record.size(), 40u);
  ASSERT_EQ(record.clock_steps.size(), 1u);
  EXPECT_EQ(record.clock_steps[0].time, record.time[20]);
  EXPECT_EQ(record.clock_steps[0].back, 4.75);
  EXPECT_GT(record.time[20] - record.time[19], record::kGapFactor * 0.25);
  EXPECT_EQ(record.time[39] - record.time[20], 4.75);
}

TEST_F(BagRecord, RepeatedStampLosesTheLaterMessageWithAWarning) {
  Recording(file("a.bag"))
      .add(Recording::motor(1, 1))
      .add(Recording::motor(2, 2))
      .add(Recording::motor(2, 9));
  const record::Record record = read_bag(file("a.bag"));
  EXPECT_EQ(record.column(record::Channel::motor_position), (std::vector<double>{1, 2}));
  ASSERT_FALSE(record.warnings.empty());
  expect_contains(record.warnings.front(), "repeated time stamp");
}

TEST_F(BagRecord, ZeroStampIsRefused) {
  Recording(file("a.bag")).add(Recording::motor(0));
  expect_contains(message_of<BadData>([&] { read_bag(file("a.bag")); }), "header.stamp = 0");
}

TEST_F(BagRecord, WrongSizesAndInfinitiesAreRefused) {
  sensor_msgs::JointState wrong = Recording::motor(2);
  wrong.effort = {1, 2};
  Recording(file("a.bag")).add(Recording::motor(1)).add(wrong);
  const std::string message = message_of<BadData>([&] { read_bag(file("a.bag")); });
  expect_contains(message, "message 1");
  expect_contains(message, "effort");
  Recording(file("b.bag")).add(Recording::motor(1, std::numeric_limits<double>::infinity()));
  expect_contains(message_of<BadData>([&] { read_bag(file("b.bag")); }), "infinite");
}

TEST_F(BagRecord, JointIsChosenOrAskedFor) {
  Recording(file("a.bag"))
      .add(Recording::motor(1, 1, 1, 1, "elbow"))
      .add(Recording::motor(1, 5, 5, 5, "wrist"))
      .add(Recording::motor(2, 2, 2, 2, "elbow"))
      .add(Recording::motor(2, 6, 6, 6, "wrist"));
  EXPECT_EQ(read_bag(file("a.bag"), "wrist").column(record::Channel::motor_position),
            (std::vector<double>{5, 6}));
  const std::string several = message_of<BadData>([&] { read_bag(file("a.bag")); });
  for (const char* part : {"--joint", "elbow", "wrist"}) expect_contains(several, part);
  const std::string absent = message_of<BadData>([&] { read_bag(file("a.bag"), "knee"); });
  for (const char* part : {"knee", "elbow", "wrist"}) expect_contains(absent, part);
}

TEST_F(BagRecord, TopicIsFoundByItsLastPart) {
  Recording(file("a.bag")).add_text("/other", "x").add(Recording::motor(1), "/robot/joint_states");
  EXPECT_EQ(read_bag(file("a.bag")).size(), 1u);
  EXPECT_EQ(read_bag(file("a.bag"), "", "/robot/joint_states").size(), 1u);
  const std::string absent = message_of<BadData>([&] { read_bag(file("a.bag"), "", "states"); });
  for (const char* part : {"/other", "/robot/joint_states", "std_msgs/String"}) expect_contains(absent, part);
  expect_contains(message_of<BadData>([&] { read_bag(file("a.bag"), "", "other"); }), "std_msgs/String");
}

TEST_F(BagRecord, JointOnSeveralTopicsIsAskedFor) {
  Recording(file("a.bag"))
      .add(Recording::motor(1), "/a/joint_states")
      .add(Recording::motor(2), "/b/joint_states");
  expect_contains(message_of<BadData>([&] { read_bag(file("a.bag")); }), "--topic");
  EXPECT_EQ(read_bag(file("a.bag"), "", "/b/joint_states").size(), 1u);
}

TEST_F(BagRecord, BagWithoutMessagesIsRefused) {
  { Recording recording(file("a.bag")); }
  expect_contains(message_of<BadData>([&] { read_bag(file("a.bag")); }), "there are: none");
}

TEST_F(BagRecord, RecordInfoOfSomebodyElseIsIgnoredWhenItIsNoText) {
  Recording(file("a.bag"))
      .add(Recording::motor(7), "/record_info")
      .add(Recording::motor(8))
      .add(Recording::motor(9));
  EXPECT_EQ(read_bag(file("a.bag")).time, (std::vector<double>{0, 1}));
  Recording(file("b.bag")).add_text("/record_info", "{name: x}").add(Recording::motor(8));
  expect_contains(message_of<BadData>([&] { read_bag(file("b.bag")); }), "time_origin");
}

TEST_F(BagRecord, FilesThatAreNoBagAreRefused) {
  expect_contains(message_of<MissingInput>([&] { read_bag(file("none.bag")); }), "none.bag");
  expect_contains(message_of<MissingInput>([&] { read_bag(folder_.string()); }), "directory");
  for (const std::string& bytes : {std::string(), std::string("time,motor_torque\n0,1\n"),
                                   std::string("#ROSBAG"), std::string("#ROSBAG V1.2\n")}) {
    const std::string path = write_bytes("a.bag", bytes);
    expect_contains(message_of<BadData>([&] { read_bag(path); }), path);
  }
}

// What is there is read, and where it ends is said; noise behind the cut is no message.
TEST_F(BagRecord, TruncatedBagIsReadUpToTheCut) {
  const int messages = 300;
  {
    rosbag::Bag bag(file("a.bag"), rosbag::bagmode::Write);
    bag.setChunkThreshold(5000);
    for (unsigned i = 1; i <= messages; ++i) {
      const sensor_msgs::JointState m = Recording::motor(i);
      bag.write("/joint_states", m.header.stamp, m);
    }
    bag.close();
  }
  const record::Record all = read_bag(file("a.bag"));
  ASSERT_EQ(all.size(), std::size_t(messages));
  EXPECT_TRUE(all.warnings.empty());
  const std::string whole = bytes_of(file("a.bag"));
  std::string noise(3000, '\0');
  std::uint32_t state = 1;
  for (char& c : noise) c = static_cast<char>((state = state * 1664525u + 1013904223u) >> 24);
  std::size_t before = 0, most = 0;
  for (std::size_t length = 0; length < whole.size(); length += 997)
    for (const std::string& behind : {std::string(), noise}) {
      const std::string path = write_bytes("cut.bag", whole.substr(0, length) + behind);
      try {
        const record::Record part = read_bag(path);
        EXPECT_EQ(part.time, std::vector<double>(all.time.begin(), all.time.begin() + long(part.size())));
        EXPECT_FALSE(part.warnings.empty()) << length;
        if (behind.empty()) {
          EXPECT_GE(part.size() + 1, before) << length;  // of a damaged chunk the last message does not count
          before = part.size();
        }
        most = std::max(most, part.size());
      } catch (const BadData& e) {
        expect_contains(e.what(), path);
        EXPECT_EQ(before, 0u) << length << ": " << e.what();
      }
    }
  EXPECT_EQ(most, std::size_t(messages));
  const record::Record part =
      read_bag(write_bytes("cut.bag", whole.substr(0, whole.size() * 6 / 10) + noise));
  EXPECT_GT(part.size(), 100u);
  ASSERT_EQ(part.warnings.size(), 1u);
  expect_contains(part.warnings[0], "nothing behind it was read");
}

TEST_F(BagRecord, UnindexedBagIsReadToItsEnd) {
  write_bag(sample_record(), file("a.bag"), "joint");
  std::string bytes = bytes_of(file("a.bag"));
  const std::string key = "index_pos=";
  const auto place =
      bytes.find(key) + key.size();  // what a recorder leaves that is killed: no index, no place of it
  std::uint64_t index = 0;
  std::memcpy(&index, bytes.data() + place, sizeof index);
  bytes.resize(index);
  bytes.replace(place, sizeof index, sizeof index, '\0');
  const record::Record read = read_bag(write_bytes("cut.bag", bytes));
  EXPECT_EQ(read.time, read_bag(file("a.bag")).time);
  expect_contains(read.warnings.back(), "not indexed");
}

// An unpacked chunk has no checksum, so a flipped bit may become another value, but never a crash or an
// endless loop.
TEST_F(BagRecord, FlippedBitsAreRefusedOrHarmless) {
  const record::Record record = sample_record({0, 0.001, 0.002});
  write_bag(record, file("packed.bag"), "joint");
  Recording(file("plain.bag")).add(Recording::motor(1)).add(Recording::motor(2));
  for (const char* name : {"packed.bag", "plain.bag"}) {
    const bool packed = std::string(name) == "packed.bag";
    const std::string whole = bytes_of(file(name));
    int refused = 0;
    for (std::size_t i = 0; i < whole.size(); i += i < 4096 ? 61 : 11) {  // the head is mostly padding
      std::string bytes = whole;
      bytes[i] = static_cast<char>(bytes[i] ^ (1 << (i % 8)));
      const std::string path = write_bytes("flipped.bag", bytes);
      try {
        const record::Record read = read_bag(path);
        if (packed && read.warnings.empty()) {  // lz4 has a checksum
          EXPECT_EQ(read.time, record.time) << "byte " << i;
          expect_same_columns(read, record);
        }
      } catch (const BadData& e) {
        ++refused;
        expect_contains(e.what(), path);
      }
    }
    EXPECT_GT(refused, 20) << name;
  }
}

TEST_F(BagRecord, WritingFailsWithoutLeavingAnything) {
  const record::Record record = sample_record();
  expect_contains(message_of<CannotWrite>([&] { write_bag(record, file("no/a.bag"), "joint"); }), "no/a.bag");
  fs::create_directory(folder_ / "d.bag");
  message_of<CannotWrite>([&] { write_bag(record, file("d.bag"), "joint"); });
  message_of<InvalidParameter>([&] { write_bag(record, file("a.bag"), ""); });
  EXPECT_EQ(files(), 1u);
}

TEST_F(BagRecord, RecordThatCannotBeReadBackLeavesTheOldFile) {
  const std::string path = write_bytes("a.bag", "old");
  const auto refused = [&](record::Record record) {
    message_of<BadData>([&] { write_bag(record, path, "joint"); });
    EXPECT_EQ(bytes_of(path), "old");
  };
  record::Record record = sample_record();
  record.column(record::Channel::motor_torque)[2] = kNan;
  refused(record);
  record = sample_record();
  record.column(record::Channel::motor_torque).pop_back();
  refused(record);
  refused(sample_record({0, 1e-10}));
  refused(sample_record({0, 5e9}));
  refused(sample_record({-1e9, 0}));  // stamp 0
  refused(record::Record());
  write_bag(sample_record(), path, "joint");
  EXPECT_EQ(read_bag(path).size(), 5u);
}

TEST_F(BagRecord, SymbolicLinkStaysALink) {
  fs::create_symlink(file("target.bag"), file("link.bag"));
  write_bytes("target.bag", "old");
  write_bag(sample_record(), file("link.bag"), "joint");
  EXPECT_TRUE(fs::is_symlink(file("link.bag")));
  EXPECT_EQ(read_bag(file("target.bag")).size(), 5u);
}

/// A robot's own names, and beside them those of this package: the latter say more.
}  // namespace
}  // namespace backlash::ros_bridge
