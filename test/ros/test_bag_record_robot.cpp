// SPDX-License-Identifier: BSD-3-Clause
// Bags of a robot with names and topics of its own.
#include <gtest/gtest.h>
#include <sensor_msgs/JointState.h>

#include <cmath>
#include <limits>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "bag_record_test.h"

namespace backlash::ros_bridge {
namespace {

/// As a robot publishes: names and fields of its own, the link's encoder on another topic at another rate.
void record_robot(const std::string& path) {
  Recording recording(path);
  for (int k = 0; k < 200; ++k) {
    sensor_msgs::JointState m;
    m.header.stamp.fromSec(50 + 0.01 * k);
    m.name = {"shoulder", "elbow"};
    m.position = {0, 0.02 * k};
    m.effort = {1, 0.5};
    recording.add(m, "/arm/joint_states");
    if (k % 2 != 0) continue;
    m.header.stamp.fromSec(50.003 + 0.01 * k);
    m.name = {"elbow_link"};
    m.position = {1 - 2 * (0.003 + 0.01 * k)};
    m.effort.clear();
    recording.add(m, "/arm/encoders");
  }
}

record::ChannelMap robot_elbow() {
  using record::Channel;
  using record::Field;
  record::ChannelMap map;
  map.joint = "elbow";
  map.declared = true;
  map.sources = {{Channel::motor_position, "joint_states", "elbow", Field::position, 1, 0},
                 {Channel::motor_torque, "joint_states", "elbow", Field::effort, 12, 0},
                 {Channel::load_position, "/arm/encoders", "elbow_link", Field::position, -1, 1}};
  return map;
}

TEST_F(BagRecord, ReadsARobotsOwnNamesAndTopics) {
  record_robot(file("robot.bag"));
  const record::Record read = read_bag(file("robot.bag"), robot_elbow());
  ASSERT_EQ(read.size(), 198u);  // the link begins 3 ms later and ends 17 ms earlier
  EXPECT_EQ(read.column(record::Channel::motor_torque).front(), 6);
  EXPECT_FALSE(read.has(record::Channel::motor_velocity));
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_NEAR(read.column(record::Channel::motor_position)[i], 2 * read.time[i], 1e-6);  // stamps of 1 ns
    EXPECT_NEAR(read.column(record::Channel::load_position)[i], 2 * read.time[i], 1e-6);
  }
}

TEST_F(BagRecord, AWrongMapIsRefusedWithWhatThereIs) {
  record_robot(file("robot.bag"));
  const auto refusal = [&](const record::ChannelMap& map) {
    return message_of<BadData>([&] { read_bag(file("robot.bag"), map); });
  };
  record::ChannelMap map = robot_elbow();
  map.sources[0].name = "knee";
  expect_contains(refusal(map),
                  "channels.motor_position: no 'knee' on /arm/joint_states; there are: elbow, shoulder");
  map = robot_elbow();
  map.sources[0].field = record::Field::velocity;
  expect_contains(refusal(map),
                  "channels.motor_position: no message on /arm/joint_states has the velocity of 'elbow'");
  map = robot_elbow();
  map.sources[2].topic = "link";
  expect_contains(refusal(map), "no topic link; there are: /arm/encoders");
}

TEST_F(BagRecord, ABagOfThisPackageHasItsNamesWhateverTheMapSays) {
  write_bag(sample_record(), file("a.bag"), "elbow");
  expect_same_columns(read_bag(file("a.bag"), robot_elbow()), read_bag(file("a.bag")));
}

TEST_F(BagRecord, ARobotIsReadByTheNamesThatSayWhichEndTheyAre) {
  record::ChannelMap stock;
  stock.joint = "elbow";
  stock.declared = true;
  stock.sources.resize(1);
  stock.sources[0].name = "elbow";
  const auto written = [this](const std::string& name, bool own) {
    rosbag::Bag bag(file(name), rosbag::bagmode::Write);
    for (unsigned i = 1; i <= 3; ++i) {
      sensor_msgs::JointState m;
      m.header.stamp = ros::Time(i, 0);
      m.name = {"elbow"}, m.position = {1.0 * i};
      if (own) m.name.insert(m.name.end(), {"elbow_motor", "elbow_load"});
      if (own) m.position.insert(m.position.end(), {10.0 * i, 20.0 * i});
      bag.write("/robot/joint_states", m.header.stamp, m);
    }
    bag.close();
    return file(name);
  };
  const record::Record own = read_robot_bag(written("own.bag", true), stock);
  EXPECT_EQ(own.column(record::Channel::motor_position), (std::vector<double>{10, 20, 30}));
  EXPECT_EQ(own.column(record::Channel::load_position), (std::vector<double>{20, 40, 60}));
  const record::Record robot = read_robot_bag(written("stock.bag", false), stock);
  EXPECT_EQ(robot.column(record::Channel::motor_position), (std::vector<double>{1, 2, 3}));
  EXPECT_FALSE(robot.has(record::Channel::load_position));
  stock.sources.push_back(stock.sources[0]);
  stock.sources[1].channel = record::Channel::motor_velocity,
  stock.sources[1].field = record::Field::velocity;
  expect_contains(message_of<BadData>([&] { read_robot_bag(file("stock.bag"), stock); }), "has the velocity");
  stock.sources[1].optional = true;
  EXPECT_FALSE(read_robot_bag(file("stock.bag"), stock).has(record::Channel::motor_velocity));
  stock.joint = stock.sources[0].name = "wrist";
  expect_contains(message_of<BadData>([&] { read_robot_bag(file("own.bag"), stock); }), "no 'wrist' on");
}

}  // namespace
}  // namespace backlash::ros_bridge
