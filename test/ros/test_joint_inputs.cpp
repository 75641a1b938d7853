// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/ros/joint_inputs.h"

namespace backlash::ros_bridge {
namespace {

using record::Channel;
using record::Field;

/// A robot's message: two joints with angles, speeds and currents.
sensor_msgs::JointState robot(double stamp) {
  sensor_msgs::JointState m;
  m.header.stamp.fromSec(stamp);
  m.name = {"shoulder_joint", "elbow_joint"};
  m.position = {1, 2 * stamp};
  m.velocity = {0, 2};
  m.effort = {5, 0.25};
  return m;
}

sensor_msgs::JointState encoder(double stamp) {
  sensor_msgs::JointState m;
  m.header.stamp.fromSec(stamp);
  m.name = {"elbow_link"};
  m.position = {-2 * stamp + 0.5};
  return m;
}

record::ChannelMap elbow() {
  record::ChannelMap map;
  map.joint = "elbow";
  map.declared = true;
  map.sources = {{Channel::motor_position, "joint_states", "elbow_joint", Field::position, 1, 0},
                 {Channel::motor_velocity, "joint_states", "elbow_joint", Field::velocity, 1, 0},
                 {Channel::motor_torque, "joint_states", "elbow_joint", Field::effort, -12, 1},
                 {Channel::load_position, "joint_states", "shoulder_joint", Field::position, 1, 0}};
  return map;
}

struct Taken {
  std::size_t joint;
  double time;
  record::ChannelValues values;
  std::string problem;
  double at(Channel channel) const { return values[static_cast<std::size_t>(channel)]; }
};

JointInputs::OnSample into(std::vector<Taken>& taken) {
  return [&taken](std::size_t joint, const ros::Time& stamp, const record::ChannelValues& values,
                  const std::string& problem) {
    taken.push_back({joint, stamp.toSec(), values, problem});
  };
}

TEST(JointInputs, ReadsAStockMessageByTheMap) {
  JointInputs inputs({elbow()});
  std::vector<Taken> taken;
  inputs.take(0, robot(10), into(taken));
  ASSERT_EQ(taken.size(), 1u);
  EXPECT_EQ(taken[0].problem, "");
  EXPECT_EQ(taken[0].at(Channel::motor_position), 20);
  EXPECT_EQ(taken[0].at(Channel::motor_velocity), 2);
  EXPECT_EQ(taken[0].at(Channel::motor_torque), -12 * 0.25 + 1);
  EXPECT_EQ(taken[0].at(Channel::load_position), 1);
  EXPECT_TRUE(std::isnan(taken[0].at(Channel::sensor_torque)));
}

TEST(JointInputs, JoinsTwoTopics) {
  record::ChannelMap map = elbow();
  map.sources[3] = {Channel::load_position, "encoders", "elbow_link", Field::position, -1, 0.5};
  JointInputs inputs({map});
  ASSERT_EQ(inputs.topics(), (std::vector<std::string>{"joint_states", "encoders"}));
  std::vector<Taken> taken;
  for (int k = 0; k < 100; ++k) {
    inputs.take(0, robot(10 + 0.01 * k), into(taken));
    inputs.take(1, encoder(10.004 + 0.01 * k), into(taken));
  }
  ASSERT_EQ(taken.size(), 99u);  // the first has no other before it
  for (const Taken& t : taken) {
    EXPECT_EQ(t.problem, "");
    EXPECT_NEAR(t.at(Channel::motor_position), 2 * t.time, 1e-6);                    // stamps are whole ns
    EXPECT_NEAR(t.at(Channel::load_position), t.at(Channel::motor_position), 1e-6);  // as encoder() has it
  }
}

TEST(JointInputs, SaysWhichNamesThereAreWhereOneIsMissing) {
  record::ChannelMap map = elbow();
  map.sources[0].name = "elbow";
  JointInputs inputs({map});
  std::vector<Taken> taken;
  for (int k = 0; k < 64; ++k) inputs.take(0, robot(10 + 0.01 * k), into(taken));
  std::vector<std::string> problems;
  for (const Taken& t : taken)
    if (!t.problem.empty()) problems.push_back(t.problem);
  ASSERT_EQ(problems.size(), 2u);  // after 32 and 64 messages
  EXPECT_EQ(problems[0],
            "channels.motor_position: no 'elbow' so far; there are: elbow_joint, shoulder_joint");
}

TEST(JointInputs, ANameMaySpeakOfSeveralJoints) {
  record::ChannelMap other = elbow();
  other.joint = "other";
  JointInputs inputs({elbow(), other});
  std::vector<Taken> taken;
  inputs.take(0, robot(10), into(taken));
  ASSERT_EQ(taken.size(), 2u);
  EXPECT_EQ(taken[0].joint, 0u);
  EXPECT_EQ(taken[1].joint, 1u);
}

}  // namespace
}  // namespace backlash::ros_bridge
