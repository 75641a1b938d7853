// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/simulated_machine.h"

#include <std_msgs/String.h>

namespace backlash::ros_bridge {

ros::Publisher publish_rig_description(const ros::NodeHandle& handle, const std::string& description) {
  ros::Publisher publisher = ros::NodeHandle(handle).advertise<std_msgs::String>("rig_description", 1, true);
  std_msgs::String message;
  message.data = description;
  publisher.publish(message);
  return publisher;
}

}  // namespace backlash::ros_bridge
