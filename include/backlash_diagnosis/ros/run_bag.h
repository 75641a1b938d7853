// SPDX-License-Identifier: BSD-3-Clause
// The bag of a driven run: every state message under its topic and every command, at the times at which they
// came and went.
#pragma once

#include <ros/time.h>
#include <sensor_msgs/JointState.h>

#include <string>
#include <utility>
#include <vector>

namespace backlash::ros_bridge {

struct RunRecording {
  struct Came {
    ros::Time at;
    std::size_t topic;
    sensor_msgs::JointState message;
  };
  std::string command_topic;
  std::vector<std::string> topics;  // of the states
  std::vector<Came> states;
  std::vector<std::pair<ros::Time, double>> commands;  // N m
  std::string outcome;                                 // how the run ended; on the topic /excite_outcome
};

/// Whole or not at all: written beside `path` and then renamed. Throws CannotWrite.
void write_run_bag(const RunRecording& recording, const std::string& path);

}  // namespace backlash::ros_bridge
