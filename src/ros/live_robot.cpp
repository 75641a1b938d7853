// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/live_robot.h"

#include <fmt/format.h>
#include <ros/callback_queue.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/node_handle.h>
#include <sensor_msgs/JointState.h>

#include <algorithm>
#include <map>
#include <memory>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "whole_bag.h"

namespace backlash::ros_bridge {
namespace {

/// A node without a name of its own for as long as it is held.
std::unique_ptr<ros::NodeHandle> join_robot() {
  if (!ros::isInitialized())
    ros::init(
        ros::M_string(), "make_rig",
        ros::init_options::AnonymousName | ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
  if (!ros::master::check())
    throw MissingInput("no ROS master at " + ros::master::getURI() +
                       ": start the robot, or set ROS_MASTER_URI to its master");
  return std::make_unique<ros::NodeHandle>();
}

std::string joint_state_topics() {
  ros::master::V_TopicInfo all;
  std::vector<std::string> names;
  if (ros::master::getTopics(all))
    for (const ros::master::TopicInfo& topic : all)
      if (topic.datatype == "sensor_msgs/JointState") names.push_back(printable(topic.name));
  return names.empty() ? "none" : joined(names);
}

struct Came {
  std::string topic;
  sensor_msgs::JointState message;
};

/// One topic while it is recorded.
struct Stream {
  ros::Subscriber subscriber;
  ros::Time first, last;
  ros::SteadyTime heard = ros::SteadyTime::now();

  double span() const { return first.isZero() ? 0 : (last - first).toSec(); }
};

}  // namespace

std::string robot_description() {
  const auto node = join_robot();
  std::string text;
  if (!node->getParam("robot_description", text))
    throw MissingInput("the parameter " + node->resolveName("robot_description") +
                       " is not there or no text: name the URDF with --urdf");
  return text;
}

void record_topics(const std::vector<std::string>& topics, double seconds, const std::string& path) {
  const auto node = join_robot();
  ros::CallbackQueue queue;
  node->setCallbackQueue(&queue);
  std::vector<Came> all;
  std::map<std::string, Stream> streams;
  for (const std::string& name : topics) {
    const std::string topic = node->resolveName(name);
    Stream& stream = streams[topic];
    stream.subscriber = node->subscribe<sensor_msgs::JointState>(
        topic, 10000, [&all, &stream, topic](const sensor_msgs::JointState::ConstPtr& message) {
          stream.heard = ros::SteadyTime::now();
          if (stream.first.isZero()) stream.first = message->header.stamp;
          stream.last = std::max(stream.last, message->header.stamp);
          all.push_back({topic, *message});
        });
  }
  const auto whole = [&] {
    return std::all_of(streams.begin(), streams.end(),
                       [&](const auto& s) { return s.second.span() >= seconds; });
  };
  while (!whole()) {
    queue.callAvailable(ros::WallDuration(0.1));
    for (const auto& [topic, stream] : streams)
      if ((ros::SteadyTime::now() - stream.heard).toSec() > kLongestSilence)
        throw MissingInput(fmt::format(
            "no message on {} for {:g} s{}; topics of sensor_msgs/JointState: {}", topic, kLongestSilence,
            stream.first.isZero() ? "" : ", after some that came or had no stamp", joint_state_topics()));
  }
  streams.clear();
  write_whole_bag(path, [&](rosbag::Bag& bag) {
    for (const Came& came : all)
      bag.write(came.topic, std::max(came.message.header.stamp, ros::TIME_MIN), came.message);
  });
}

}  // namespace backlash::ros_bridge
