// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/published_names.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/recording/recording.h"
#include "message_source.h"

namespace backlash::ros_bridge {
namespace {

bool is_there(const std::vector<double>& values, std::size_t i) {
  return i < values.size() && std::isfinite(values[i]);
}

}  // namespace

std::vector<PublishedName> published_names(const std::string& path) {
  const auto source = recording::is_recording(path) ? open_ros2_recording(path) : open_bag(path);
  std::vector<std::string> topics;
  std::set<std::string> others;
  for (const MessageSource::Topic& topic : source->topics()) {
    if (!topic.joint_states)
      others.insert(printable(topic.name) + " (" + topic.type + ")");
    else if (std::find(topics.begin(), topics.end(), topic.name) == topics.end())
      topics.push_back(topic.name);
  }
  if (topics.empty())
    throw BadData(path, "no topic of " + source->expected_type() +
                            "; there are: " + (others.empty() ? "none" : joined(others)));
  std::vector<PublishedName> names;
  std::map<std::pair<std::string, std::string>, std::size_t> place;
  source->read(topics, [&](const sensor_msgs::JointState& message, const std::string& topic) {
    for (std::size_t i = 0; i < message.name.size(); ++i) {
      const auto [found, fresh] = place.emplace(std::make_pair(topic, message.name[i]), names.size());
      if (fresh) names.push_back({topic, message.name[i]});
      PublishedName& n = names[found->second];
      ++n.messages;
      n.position = n.position || is_there(message.position, i);
      n.velocity = n.velocity || is_there(message.velocity, i);
      n.effort = n.effort || is_there(message.effort, i);
    }
  });
  if (names.empty()) throw BadData(path, "no message names a joint on " + joined(topics));
  return names;
}

}  // namespace backlash::ros_bridge
