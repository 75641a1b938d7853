// SPDX-License-Identifier: BSD-3-Clause
// What an offline command takes from a robot that is running.
#pragma once

#include <string>
#include <vector>

namespace backlash::ros_bridge {

/// The parameter robot_description, text of a URDF. Throws MissingInput without a ROS master or the
/// parameter.
std::string robot_description();

/// Records so many seconds of stamps on these topics of sensor_msgs/JointState into a bag, which is written
/// whole or not at all. Throws MissingInput without a ROS master, or where a topic is silent for
/// kLongestSilence, naming those that carry joint states; CannotWrite.
void record_topics(const std::vector<std::string>& topics, double seconds, const std::string& path);
constexpr double kLongestSilence = 10;  ///< s of wall time: choice

}  // namespace backlash::ros_bridge
