// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/joint_state.h"

namespace backlash::ros_bridge {
namespace {

double of(const record::ChannelValues& values, record::Channel channel) {
  return values[static_cast<std::size_t>(channel)];
}

TEST(JointState, CurrentAndAccelerationAreEffortsOfNamesOfTheirOwn) {
  sensor_msgs::JointState m;
  m.name = {"elbow_accelerometer", "wrist_current", "elbow_current", "elbow_motor"};
  m.effort = {-120, 9, 1.5, 0.05};
  EXPECT_EQ(JointStateReader({record::usual_channels("elbow")}).read(m).size(), 1u);
  const record::ChannelValues values = read_joint_state(m, "elbow", "joint_states");
  EXPECT_EQ(of(values, record::Channel::acceleration), -120);
  EXPECT_EQ(of(values, record::Channel::motor_current), 1.5);
  EXPECT_EQ(of(values, record::Channel::motor_torque), 0.05);
  EXPECT_TRUE(std::isnan(of(values, record::Channel::sensor_torque)));
  EXPECT_TRUE(std::isnan(of(values, record::Channel::motor_position)));
}

TEST(JointState, TheEffortOfTheLoadIsTheTorqueBehindTheGear) {
  sensor_msgs::JointState m;
  m.name = {"elbow_load"};
  m.effort = {-3};
  EXPECT_EQ(of(read_joint_state(m, "elbow", "joint_states"), record::Channel::output_torque), -3);
}

TEST(JointState, EitherNameAloneIsTheJoint) {
  for (const std::string suffix : {"_current", "_accelerometer"}) {
    sensor_msgs::JointState m;
    m.name = {"elbow" + suffix};
    m.effort = {2};
    EXPECT_EQ(JointStateReader({record::usual_channels("elbow")}).read(m).size(), 1u);
    EXPECT_TRUE(JointStateReader({record::usual_channels("wrist")}).read(m).empty());
    m.effort.clear();
    m.position = {3};  // says nothing of these two
    const record::ChannelValues values = read_joint_state(m, "elbow", "joint_states");
    EXPECT_TRUE(std::all_of(values.begin(), values.end(), [](double v) { return std::isnan(v); }));
  }
}

TEST(JointState, WrongOnesAreRefusedByName) {
  sensor_msgs::JointState m;
  m.name = {"elbow_current", "elbow_current"};
  m.effort = {1, 2};
  const auto refused = [&m](const std::string& reason) {
    try {
      read_joint_state(m, "elbow", "joint_states");
      ADD_FAILURE() << "accepted; expected: " << reason;
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(reason), std::string::npos) << error.what();
    }
  };
  refused("elbow_current appears twice");
  m.name = {"elbow_current", "elbow_accelerometer"};
  m.effort = {1, INFINITY};
  refused("elbow_accelerometer effort is infinite");
}

TEST(JointState, ARecordsSampleComesBackAsItWas) {
  record::Record record;
  record.time = {0, 1};
  double value = 0.5;
  for (const record::Channel channel : record::kChannels) record.column(channel) = {value += 1, value += 1};
  const record::ChannelValues values =
      read_joint_state(make_joint_state(record, 1, JointNames("elbow")), "elbow", "t");
  for (const record::Channel channel : record::kChannels)
    EXPECT_EQ(of(values, channel), record.column(channel)[1]) << record::channel_name(channel);
}

TEST(JointState, TheSimulatorNamesOnlyWhatIsMeasured) {
  model::Observation o{};
  o.motor_current = std::nan("");
  o.acceleration = std::nan("");
  const JointNames names("elbow");
  EXPECT_EQ(make_joint_state(o, names).name,
            (std::vector<std::string>{"elbow_motor", "elbow_sensor", "elbow_load"}));
  o.motor_current = 1.5;
  o.acceleration = -120;
  const sensor_msgs::JointState m = make_joint_state(o, names);
  EXPECT_EQ(m.name.size(), 5u);
  const record::ChannelValues values = read_joint_state(m, "elbow", "t");
  EXPECT_EQ(of(values, record::Channel::motor_current), 1.5);
  EXPECT_EQ(of(values, record::Channel::acceleration), -120);
}

TEST(JointStateReader, DistinguishesTheJointsOfAMessage) {
  JointStateReader reader(
      {record::usual_channels("elbow"), record::usual_channels("wrist"), record::usual_channels("knee")});
  sensor_msgs::JointState m;
  m.name = {"wrist_motor", "other_motor", "elbow_motor", "wrist_load", "knee_reference"};
  m.position = {1, 2, 3, 4, 5};
  m.effort = {10, 20, 30, NAN, NAN};
  EXPECT_EQ(reader.read(m), (std::vector<std::size_t>{1, 0})) << "a reference alone is no mention";
  EXPECT_EQ(of(reader.values(1), record::Channel::motor_torque), 10);
  EXPECT_EQ(of(reader.values(1), record::Channel::load_position), 4);
  EXPECT_EQ(of(reader.values(0), record::Channel::motor_position), 3);
  EXPECT_TRUE(std::isnan(of(reader.values(0), record::Channel::load_position)));
  m.name = {"knee_reference", "knee_motor"};  // nothing of the last message is left
  m.position = {5, 6};
  m.effort.clear();
  EXPECT_EQ(reader.read(m), (std::vector<std::size_t>{2}));
  EXPECT_EQ(of(reader.values(2), record::Channel::reference_position), 5);
  EXPECT_TRUE(std::isnan(of(reader.values(1), record::Channel::motor_torque)));
}

TEST(JointStateReader, AProblemOfOneJointIsNotTheOthers) {
  JointStateReader reader({record::usual_channels("elbow"), record::usual_channels("wrist")});
  sensor_msgs::JointState m;
  m.name = {"elbow_motor", "wrist_motor", "elbow_motor"};
  m.effort = {1, 2, 3};
  EXPECT_EQ(reader.read(m).size(), 2u);
  EXPECT_EQ(reader.problem(0), "the name elbow_motor appears twice");
  EXPECT_EQ(reader.problem(1), "");
  m.effort = {1, 2};
  reader.read(m);
  for (const std::size_t joint : {0, 1}) EXPECT_EQ(reader.problem(joint), "effort has 2 values for 3 names");
  m.name = {"wrist_motor"};
  m.effort = {2};
  reader.read(m);
  EXPECT_EQ(reader.problem(1), "");
}

/// Others than a robot's own name say which end is meant; who looks at a robot sees its links.
TEST(JointState, ARobotsOwnNameIsTheLinkAndTheTorqueOfItsMotor) {
  model::Observation o{};
  o.motor_position = 1, o.load_position = 2, o.load_velocity = 3, o.motor_torque = 4, o.output_torque = 5;
  sensor_msgs::JointState m;
  add_robot_joint(o, "elbow", m);
  EXPECT_EQ(m.name, std::vector<std::string>{"elbow"});
  EXPECT_EQ(m.position, std::vector<double>{2});
  EXPECT_EQ(m.velocity, std::vector<double>{3});
  EXPECT_EQ(m.effort, std::vector<double>{4});
}

}  // namespace
}  // namespace backlash::ros_bridge
