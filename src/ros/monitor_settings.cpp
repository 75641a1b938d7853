// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/monitor_settings.h"

#include <filesystem>
#include <map>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/rig_folder.h"

namespace backlash::ros_bridge {
namespace {

/// The channel map under ~NAME; nothing where there is none.
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

void use_limits(MonitorSettings& monitor, const std::string& path) {
  if (path.empty()) return;
  const diagnosis::Limits limits = diagnosis::read_limits_file(path);
  diagnosis::check_limits(limits, monitor.rig.rig.mesh.angular(), path);
  monitor.rig.diagnosis.limits = limits;
}

/// A file that is not there yet is one to be written.
void use_baseline(MonitorSettings& monitor, const std::string& path) {
  monitor.baseline_path = path;
  if (path.empty()) return;
  const auto folder = std::filesystem::path(path).parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw InvalidParameter("~baseline", path, "is in a folder that does not exist");
  if (!std::filesystem::exists(path)) return;
  monitor.baseline = diagnosis::read_baseline(path);
  diagnosis::check_baseline(*monitor.baseline, monitor.rig.rig.name, monitor.rig.digest, path);
}

void use_curve(MonitorSettings& monitor, const std::string& path) {
  if (path.empty()) return;
  monitor.curve = diagnosis::read_curve(path);
  monitor.curve_warning = studies::check_curve(*monitor.curve, monitor.rig, path);
}

/// What is said of all joints.
struct Common {
  std::map<std::string, rig_file::RigFile> by_joint;  // of ~rig_folder
  std::optional<rig_file::RigFile> rig;
  std::string curve, limits, baseline;
  std::vector<std::string> joints;
};

Common read_common(Parameters& parameters) {
  Common common;
  const std::string rig = parameters.text("rig", ""), folder = parameters.text("rig_folder", "");
  if (!rig.empty() && !folder.empty())
    throw InvalidParameter("~rig_folder", folder, "cannot be given beside ~rig (" + rig + ")");
  if (folder.empty()) {
    common.rig = rig.empty() ? rig_file::default_rig_file() : rig_file::load_rig_file(rig);
    common.joints = {common.rig->rig.joint};
  } else {
    common.by_joint = load_rig_folder(folder);
    for (const auto& [joint, file] : common.by_joint) common.joints.push_back(joint);
  }
  common.joints = parameters.texts("joints", common.joints);
  common.curve = parameters.text("curve", "");
  common.limits = parameters.text("limits", "");
  common.baseline = parameters.text("baseline", "");
  if (common.joints.size() > 1 && !common.baseline.empty())
    throw InvalidParameter("~baseline", common.baseline,
                           "is one file for several joints; give each its JOINT/baseline");
  return common;
}

rig_file::RigFile rig_of(const std::string& joint, const Common& common, const std::string& own) {
  if (!own.empty()) return rig_file::load_rig_file(own);
  if (!common.rig) {
    const auto found = common.by_joint.find(joint);
    if (found == common.by_joint.end())
      throw InvalidParameter("~joints", joint, "has no rig file in ~rig_folder");
    return found->second;
  }
  if (common.rig->channels.declared && common.joints.size() > 1)
    throw InvalidParameter("~joints", joint,
                           "shares a rig file whose channels are of one joint; give each its JOINT/rig");
  return *common.rig;
}

MonitorSettings load_monitor(Parameters& parameters, const std::string& joint, const Common& common,
                             MonitorSettings monitor) {
  monitor.joint = joint;
  parameters.allow(joint + "/live");
  monitor.rig = rig_of(joint, common, parameters.text(joint + "/rig", ""));
  auto channels = read_channels(parameters, joint + "/channels", joint);
  if (!channels && common.joints.size() == 1) channels = read_channels(parameters, "channels", joint);
  if (channels) monitor.rig.channels = *channels;
  use_curve(monitor, parameters.text(joint + "/curve", common.curve));
  use_limits(monitor, parameters.text(joint + "/limits", common.limits));
  use_baseline(monitor, parameters.text(joint + "/baseline", common.baseline));
  return monitor;
}

}  // namespace

std::vector<MonitorSettings> load_monitors(Parameters& parameters, const MonitorSettings& defaults) {
  const Common common = read_common(parameters);
  std::vector<MonitorSettings> monitors;
  for (const std::string& joint : common.joints) {
    for (const MonitorSettings& other : monitors)
      if (other.joint == joint) throw InvalidParameter("~joints", joint, "is named twice");
    monitors.push_back(load_monitor(parameters, joint, common, defaults));
  }
  return monitors;
}

}  // namespace backlash::ros_bridge
