#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/joint_state.h"

namespace backlash {
namespace {

double of(const ChannelValues& values, Channel channel) {
  return values[static_cast<std::size_t>(channel)];
}

TEST(JointState, CurrentAndAccelerationAreEffortsOfNamesOfTheirOwn) {
  sensor_msgs::JointState m;
  m.name = {"elbow_accelerometer", "wrist_current", "elbow_current", "elbow_motor"};
  m.effort = {-120, 9, 1.5, 0.05};
  const JointNames names("elbow");
  EXPECT_TRUE(mentions(m, names));
  const ChannelValues values = read_joint_state(m, names, "joint_states");
  EXPECT_EQ(of(values, Channel::acceleration), -120);
  EXPECT_EQ(of(values, Channel::motor_current), 1.5);
  EXPECT_EQ(of(values, Channel::motor_torque), 0.05);
  EXPECT_TRUE(std::isnan(of(values, Channel::sensor_torque)));
  EXPECT_TRUE(std::isnan(of(values, Channel::motor_position)));
}

TEST(JointState, EitherNameAloneIsTheJoint) {
  for (const std::string suffix : {"_current", "_accelerometer"}) {
    sensor_msgs::JointState m;
    m.name = {"elbow" + suffix};
    m.effort = {2};
    EXPECT_TRUE(mentions(m, JointNames("elbow")));
    EXPECT_FALSE(mentions(m, JointNames("wrist")));
    m.effort.clear();
    m.position = {3};  // says nothing of these two
    const ChannelValues values = read_joint_state(m, JointNames("elbow"), "joint_states");
    EXPECT_TRUE(std::all_of(values.begin(), values.end(), [](double v) { return std::isnan(v); }));
  }
}

TEST(JointState, WrongOnesAreRefusedByName) {
  sensor_msgs::JointState m;
  m.name = {"elbow_current", "elbow_current"};
  m.effort = {1, 2};
  const auto refused = [&m](const std::string& reason) {
    try {
      read_joint_state(m, JointNames("elbow"), "joint_states");
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
  Record record;
  record.time = {0, 1};
  double value = 0.5;
  for (const Channel channel : kChannels) record.column(channel) = {value += 1, value += 1};
  const ChannelValues values =
      read_joint_state(make_joint_state(record, 1, JointNames("elbow")), JointNames("elbow"), "t");
  for (const Channel channel : kChannels)
    EXPECT_EQ(of(values, channel), record.column(channel)[1]) << channel_name(channel);
}

TEST(JointState, TheSimulatorNamesOnlyWhatIsMeasured) {
  Observation o{};
  o.motor_current = std::nan("");
  o.acceleration = std::nan("");
  const JointNames names("elbow");
  EXPECT_EQ(make_joint_state(o, names).name,
            (std::vector<std::string>{"elbow_motor", "elbow_sensor", "elbow_load"}));
  o.motor_current = 1.5;
  o.acceleration = -120;
  const sensor_msgs::JointState m = make_joint_state(o, names);
  EXPECT_EQ(m.name.size(), 5u);
  const ChannelValues values = read_joint_state(m, names, "t");
  EXPECT_EQ(of(values, Channel::motor_current), 1.5);
  EXPECT_EQ(of(values, Channel::acceleration), -120);
}

}  // namespace
}  // namespace backlash
