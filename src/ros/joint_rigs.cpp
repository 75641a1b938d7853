// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/joint_rigs.h"

#include <algorithm>
#include <map>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/rig_folder.h"

namespace backlash::ros_bridge {

std::optional<record::ChannelMap> read_channels(Parameters& parameters, const std::string& name,
                                                const std::string& joint) {
  if (!parameters.has(name)) return std::nullopt;
  record::ChannelMap map;
  map.joint = joint;
  map.declared = true;
  for (const record::Channel channel : record::kChannels) {
    const std::string key = name + "/" + record::channel_name(channel);
    if (!parameters.has(key)) continue;
    record::ChannelSource source;
    source.channel = channel;
    source.topic = parameters.text(key + "/topic", source.topic);
    source.name = parameters.text(key + "/name", "");
    const std::string field = parameters.text(key + "/field", field_name(record::usual_field(channel)));
    const auto known = record::field_from_name(field);
    if (!known) throw InvalidParameter("~" + key + "/field", field, "must be position, velocity or effort");
    source.field = *known;
    source.scale = parameters.number(key + "/scale", source.scale, Range::any());
    source.offset = parameters.number(key + "/offset", source.offset, Range::any());
    map.sources.push_back(std::move(source));
  }
  try {
    record::check(map);
  } catch (const InvalidParameter& error) {
    throw InvalidParameter("~" + name, joint, error.what());
  }
  return map;
}

record::ChannelMap robot_channels(const std::string& joint, record::Channel effort) {
  record::ChannelMap map;
  map.joint = joint;
  map.declared = true;
  for (const auto& [channel, field] : {std::pair{record::Channel::motor_position, record::Field::position},
                                       std::pair{record::Channel::motor_velocity, record::Field::velocity},
                                       std::pair{effort, record::Field::effort}}) {
    record::ChannelSource source;
    source.channel = channel;
    source.name = joint;
    source.field = field;
    source.optional = channel == record::Channel::motor_velocity;  // the positions have it as well
    map.sources.push_back(source);
  }
  return map;
}

namespace {

/// What is said of all joints.
struct Rigs {
  std::map<std::string, rig_file::RigFile> by_joint;  // of ~rig_folder
  std::optional<rig_file::RigFile> rig;
  std::vector<std::string> joints;
};

Rigs read_rigs(Parameters& parameters) {
  Rigs rigs;
  const std::string rig = parameters.text("rig", ""), folder = parameters.text("rig_folder", "");
  if (!rig.empty() && !folder.empty())
    throw InvalidParameter("~rig_folder", folder, "cannot be given beside ~rig (" + rig + ")");
  if (folder.empty()) {
    rigs.rig = rig.empty() ? rig_file::default_rig_file() : rig_file::load_rig_file(rig);
    rigs.joints = {rigs.rig->rig.joint};
  } else {
    rigs.by_joint = load_rig_folder(folder);
    for (const auto& [joint, file] : rigs.by_joint) rigs.joints.push_back(joint);
  }
  rigs.joints = parameters.texts("joints", rigs.joints);
  return rigs;
}

rig_file::RigFile rig_of(const std::string& joint, const Rigs& rigs, const std::string& own) {
  if (!own.empty()) return rig_file::load_rig_file(own);
  if (!rigs.rig) {
    const auto found = rigs.by_joint.find(joint);
    if (found == rigs.by_joint.end())
      throw InvalidParameter("~joints", joint, "has no rig file in ~rig_folder");
    return found->second;
  }
  if (rigs.rig->channels.declared && rigs.joints.size() > 1)
    throw InvalidParameter("~joints", joint,
                           "shares a rig file whose channels are of one joint; give each its JOINT/rig");
  return *rigs.rig;
}

}  // namespace

record::ChannelMap JointRig::channels() const {
  record::ChannelMap map = rig.channels.declared ? rig.channels : record::usual_channels(joint);
  map.joint = joint;
  return map;
}

std::vector<JointRig> load_joint_rigs(Parameters& parameters) {
  const Rigs rigs = read_rigs(parameters);
  std::vector<JointRig> joints;
  for (const std::string& joint : rigs.joints) {
    for (const JointRig& other : joints)
      if (other.joint == joint) throw InvalidParameter("~joints", joint, "is named twice");
    JointRig one{joint, rig_of(joint, rigs, parameters.text(joint + "/rig", ""))};
    auto channels = read_channels(parameters, joint + "/channels", joint);
    if (!channels && rigs.joints.size() == 1) channels = read_channels(parameters, "channels", joint);
    if (channels) one.rig.channels = *channels;
    joints.push_back(std::move(one));
  }
  return joints;
}

std::string joint_path(const std::string& folder, std::string joint, const std::string& ending) {
  std::replace(joint.begin(), joint.end(), '/', '_');
  return folder + "/" + joint + ending;
}

}  // namespace backlash::ros_bridge
