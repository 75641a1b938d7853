// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/monitor_settings.h"

#include <filesystem>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/joint_rigs.h"

namespace backlash::ros_bridge {
namespace {

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
  std::string curve, limits, baseline;
};

MonitorSettings load_monitor(Parameters& parameters, const JointRig& rig, const Common& common,
                             MonitorSettings monitor) {
  const std::string& joint = rig.joint;
  monitor.joint = joint;
  monitor.rig = rig.rig;
  use_curve(monitor, parameters.text(joint + "/curve", common.curve));
  use_limits(monitor, parameters.text(joint + "/limits", common.limits));
  use_baseline(monitor, parameters.text(joint + "/baseline", common.baseline));
  return monitor;
}

}  // namespace

std::vector<MonitorSettings> load_monitors(Parameters& parameters, const MonitorSettings& defaults) {
  const std::vector<JointRig> joints = load_joint_rigs(parameters);
  const Common common = {parameters.text("curve", ""), parameters.text("limits", ""),
                         parameters.text("baseline", "")};
  if (joints.size() > 1 && !common.baseline.empty())
    throw InvalidParameter("~baseline", common.baseline,
                           "is one file for several joints; give each its JOINT/baseline");
  std::vector<MonitorSettings> monitors;
  for (const JointRig& joint : joints) monitors.push_back(load_monitor(parameters, joint, common, defaults));
  return monitors;
}

}  // namespace backlash::ros_bridge
