// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/run_bag.h"

#include <std_msgs/Float64.h>
#include <std_msgs/String.h>

#include "whole_bag.h"

namespace backlash::ros_bridge {
namespace {

const char* const kOutcomeTopic = "/excite_outcome";

void write_all(rosbag::Bag& bag, const RunRecording& recording) {
  ros::Time last(1, 0);  // a bag knows no time 0
  for (const auto& came : recording.states) {
    last = std::max(last, came.at);
    bag.write(recording.topics.at(came.topic), std::max(came.at, ros::TIME_MIN), came.message);
  }
  for (const auto& [at, torque] : recording.commands) {
    last = std::max(last, at);
    std_msgs::Float64 message;
    message.data = torque;
    bag.write(recording.command_topic, std::max(at, ros::TIME_MIN), message);
  }
  std_msgs::String outcome;
  outcome.data = recording.outcome;
  bag.write(kOutcomeTopic, last, outcome);
}

}  // namespace

void write_run_bag(const RunRecording& recording, const std::string& path) {
  write_whole_bag(path, [&](rosbag::Bag& bag) { write_all(bag, recording); });
}

}  // namespace backlash::ros_bridge
