// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/joint_inputs.h"

#include <fmt/format.h>

#include <algorithm>

#include "backlash_diagnosis/base/text.h"

namespace backlash::ros_bridge {
namespace {

constexpr std::size_t kMostNames = 200;  // choice: of a topic, that are listed
constexpr long kFirstLook = 20;  // choice: messages, before a name that has not come is missed: a robot may
                                 // publish its parts in turn

}  // namespace

JointInputs::JointInputs(const std::vector<record::ChannelMap>& joints) {
  for (const record::ChannelMap& map : joints)
    for (const std::string& topic : map.topics())
      if (std::find(topics_.begin(), topics_.end(), topic) == topics_.end()) topics_.push_back(topic);
  for (const record::ChannelMap& map : joints) {
    Joint joint;
    joint.map = map;
    const std::vector<std::string> own = map.topics();
    joint.count = own.size();
    for (const std::string& topic : topics_)
      joint.streams.push_back(std::size_t(std::find(own.begin(), own.end(), topic) - own.begin()));
    if (joint.count > 1) joint.joiner.emplace(joint.count);
    joints_.push_back(std::move(joint));
  }
  for (const std::string& topic : topics_) {
    std::vector<record::ChannelMap> parts;
    for (const record::ChannelMap& map : joints) parts.push_back(map.on(topic));
    states_.push_back({JointStateReader(parts), {}, 0, false});
  }
}

void JointInputs::take(std::size_t topic, const sensor_msgs::JointState& message, const OnSample& on_sample) {
  Topic& state = states_[topic];
  for (const std::size_t joint : state.reader.read(message)) {
    const std::string& problem = state.reader.problem(joint);
    if (!joints_[joint].joiner || !problem.empty() || message.header.stamp.isZero())
      on_sample(joint, message.header.stamp, state.reader.values(joint), problem);
    else
      join(joint, topic, message.header.stamp, on_sample);
  }
  if (!state.complete) look_for_names(topic, message, on_sample);
}

void JointInputs::join(std::size_t place, std::size_t topic, const ros::Time& stamp,
                       const OnSample& on_sample) {
  static const std::string kNoProblem;
  Joint& joint = joints_[place];
  joint.joiner->add(joint.streams[topic], {joint.clock.seconds(stamp), states_[topic].reader.values(place)});
  while (const auto sample = joint.joiner->next())
    on_sample(place, joint.clock.stamp(sample->time), sample->values, kNoProblem);
}

/// Complains of declared names that do not come, ever more seldom.
void JointInputs::look_for_names(std::size_t topic, const sensor_msgs::JointState& message,
                                 const OnSample& on_sample) {
  Topic& state = states_[topic];
  if (state.names.size() < kMostNames) state.names.insert(message.name.begin(), message.name.end());
  const bool look = ++state.messages >= kFirstLook && (state.messages & (state.messages - 1)) == 0;
  state.complete = true;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (!joints_[i].map.declared) continue;
    for (const record::ChannelSource& source : joints_[i].map.sources) {
      if (source.topic != topics_[topic] || state.names.count(source.name) > 0) continue;
      state.complete = false;
      if (!look) continue;
      std::vector<std::string> there;
      for (const std::string& name : state.names) there.push_back(printable(name));
      on_sample(i, message.header.stamp, state.reader.values(i),
                fmt::format("channels.{}: no '{}' so far; there are: {}",
                            record::channel_name(source.channel), printable(source.name), joined(there)));
    }
  }
}

}  // namespace backlash::ros_bridge
