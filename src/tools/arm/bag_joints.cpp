// SPDX-License-Identifier: BSD-3-Clause
#include "tools/arm/bag_joints.h"

#include <algorithm>
#include <limits>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/numbers.h"
#include "backlash_diagnosis/rig_draft/seen_joint.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "backlash_diagnosis/ros/published_names.h"

namespace backlash::tools {
namespace {

using ros_bridge::PublishedName;

const std::string kMotor = "_motor";

std::string bare(const std::string& topic) {
  return topic.substr(std::min(topic.find_first_not_of('/'), topic.size()));
}

bool ends_with(const std::string& text, const std::string& ending) {
  return text.size() > ending.size() &&
         text.compare(text.size() - ending.size(), std::string::npos, ending) == 0;
}

record::ChannelSource source(record::Channel channel, const PublishedName& name, record::Field field) {
  record::ChannelSource s;
  s.channel = channel;
  s.topic = bare(name.topic);
  s.name = name.name;
  s.field = field;
  return s;
}

FoundJoint own_joint(const std::string& joint) {
  return {joint, record::usual_channels(joint)};
}

FoundJoint robot_joint(const PublishedName& name) {
  FoundJoint found{name.name, {}};
  found.channels.joint = name.name;
  found.channels.declared = true;
  found.channels.sources = {source(record::Channel::motor_position, name, record::Field::position)};
  if (name.effort)
    found.channels.sources.push_back(source(record::Channel::motor_torque, name, record::Field::effort));
  return found;
}

/// How far the name strays from the joint, relative to how far it goes; infinite where it does not go along.
double strays(const std::string& path, const FoundJoint& joint, const PublishedName& name) {
  record::ChannelMap map;
  map.joint = joint.joint;
  map.declared = true;
  map.sources = {joint.channels.sources.front(),
                 source(record::Channel::load_position, name, record::Field::position)};
  try {
    record::Record record = ros_bridge::read_bag(path, map);
    record::keep_rows_with_numbers({&record});
    const rig_draft::SeenJoint seen = rig_draft::look_at_joint({std::move(record), {}});
    if (seen.load) return seen.load->looseness * std::abs(seen.load->motor_turns) / seen.travel;
  } catch (const BadData&) {  // too short, or at rest
  }
  return std::numeric_limits<double>::infinity();
}

void add_links(const std::string& path, const std::vector<PublishedName>& names,
               std::vector<FoundJoint>& joints) {
  for (const PublishedName& name : names) {
    if (!name.position || name.effort) continue;
    FoundJoint* nearest = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (FoundJoint& joint : joints)
      if (const double far = strays(path, joint, name); far < least) least = far, nearest = &joint;
    const auto taken = [](const record::ChannelSource& s) {
      return s.channel == record::Channel::load_position;
    };
    if (nearest == nullptr ||
        std::any_of(nearest->channels.sources.begin(), nearest->channels.sources.end(), taken))
      continue;
    nearest->channels.sources.push_back(
        source(record::Channel::load_position, name, record::Field::position));
  }
}

}  // namespace

std::vector<FoundJoint> joints_of_bag(const std::string& path) {
  const std::vector<PublishedName> names = ros_bridge::published_names(path);
  std::vector<FoundJoint> joints;
  for (const PublishedName& name : names)
    if (name.position && ends_with(name.name, kMotor))
      joints.push_back(own_joint(name.name.substr(0, name.name.size() - kMotor.size())));
  if (!joints.empty()) return joints;
  const bool efforts =
      std::any_of(names.begin(), names.end(), [](const PublishedName& n) { return n.position && n.effort; });
  std::set<std::string> there;
  for (const PublishedName& name : names) {
    there.insert(printable(name.name) + " on " + printable(name.topic));
    if (name.position && name.effort == efforts) joints.push_back(robot_joint(name));
  }
  if (joints.empty()) throw BadData(path, "no name has a position; there are: " + joined(there));
  if (efforts) add_links(path, names, joints);
  return joints;
}

}  // namespace backlash::tools
