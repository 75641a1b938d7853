// SPDX-License-Identifier: BSD-3-Clause
// What a bag or a recording of ROS 2 has of joints: the names on its topics of sensor_msgs/JointState, and
// which fields of them carry numbers.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace backlash::ros_bridge {

struct PublishedName {
  std::string topic, name;
  bool position = false, velocity = false, effort = false;  // a finite number in some message
  std::size_t messages = 0;
};

/// By topic, in the order in which they turn up. Throws MissingInput, BadData; BadData too where no topic
/// carries joint states, naming those that are there.
std::vector<PublishedName> published_names(const std::string& path);

}  // namespace backlash::ros_bridge
