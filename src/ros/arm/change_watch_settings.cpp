// SPDX-License-Identifier: BSD-3-Clause
// Parameters of the node `change_watch`.
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file_folder.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/ros/arm/change_watch_node.h"
#include "backlash_diagnosis/ros/node_folders.h"

namespace backlash::ros_bridge {
namespace {

constexpr std::pair<const char*, double> kHours[] = {
    {"hour", 1}, {"day", 24}, {"week", 168}, {"month", 720}, {"year", 8760}};
constexpr double kShortest = 60;  // s, of a window or of what is learned from: twice what can be judged

}  // namespace

double false_alarm_rate(const std::string& text) {
  const auto wrong = [&] {
    return InvalidParameter("~false_alarms", printable(text),
                            "must be as '1 per month' (hour, day, week, month, year), > 0");
  };
  const std::size_t per = text.find(" per ");
  if (per == std::string::npos) throw wrong();
  const ParsedNumber count = parse_number(trimmed(text.substr(0, per)));
  const std::string unit(trimmed(text.substr(per + 5)));
  for (const auto& [name, hours] : kHours)
    if (unit == name && count && count.value > 0) return count.value / hours;
  throw wrong();
}

const char* change_watch_help() {
  return R"(change_watch: finds out whether joints differ from what they were when commissioned, and since when

usage: rosrun backlash_diagnosis change_watch [_PARAMETER:=VALUE ...] [NAME:=REMAPPED ...]

parameters (private)
  rig       path of the rig file of a joint of one inertia (mesh: rigid), of two (rigid couplings, a free
            link), whose backlash is watched where load_position is among its channels, of a pinion with a
            torque sensor (elastic input_coupling), which needs sensor_torque, or of an arm (urdf), whose
            joints are watched together, and what it carries; or
  rig_folder  folder with a rig file for each joint of a robot; of others it reports no answer
  joints    list of joint names; default: the joint of the rig file, or all of rig_folder
  channels/CHANNEL/...   topic, name, field, scale, offset: where the robot publishes that channel, as
            `channels` of the rig file, and instead of them
  healthy   list (in a launch file: <rosparam>) of records (.csv, .bag, .mcap) of the healthy machine;
            default: the record of an earlier start in folder, else the machine is learned from what it
            does first
  learn     s of samples that the healthy machine is learned from; default 600, at least 60. They should
            hold all of its tasks, and the way from cold to warm
  false_alarms   how often healthy joints may be called changed, all joints together; default
            '1 per month' (also hour, day, week, year)
  window    s that a look sees; default 300, at least 60
  check_interval   s of stamps from one look to the next; default 60
  JOINT/rig, JOINT/channels, JOINT/healthy   the same for one of several joints; of an arm JOINT/channels
            only, default: position and effort of JOINT
  folder    where JOINT_healthy.csv is kept, the record that was learned from: delete it to learn anew;
            and JOINT_changed.csv, what the last look saw that reported a change; default: backlash_diagnosis in ROS_HOME (~/.ros)
  history   folder, which must exist, for a file JOINT_changes.csv with all that was reported; default: none
  queue     messages waiting at most; default 20000
  stale     s of wall time without a message before /diagnostics says so; default 2
  look_share   of one processor's time that looks may take, one after the other; default 1. Where joints are
            too many for that, each is looked at less often than check_interval
  job_memory   GB that the process of a look may use; default 4

subscribes
  joint_states   sensor_msgs/JointState: JOINT_motor with position and effort; other topics and names where
                 the rig file's `channels` say so
publishes
  changes        backlash_diagnosis/ChangeReport, latched: when a change is new, known better, over,
                 withdrawn or no longer seen
  /diagnostics   diagnostic_msgs/DiagnosticArray: "JOINT: model", OK, WARN (changed), STALE (cannot tell)
)";
}

namespace {

/// What ~rig, ~rig_folder and ~joints name: joints, each by a rig file of its own, or an arm by one.
std::vector<WatchSettings> watched(Parameters& parameters) {
  std::vector<WatchSettings> all;
  const std::string rig = parameters.text("rig", "");
  if (rig.empty() || !rig_file::is_arm_rig(rig)) {
    for (JointRig& joint : load_joint_rigs(parameters)) {
      all.emplace_back();
      all.back().joint = std::move(joint);
    }
    return all;
  }
  WatchSettings one;
  one.arm = arm::load_arm_rig(rig);
  one.joint.joint = one.arm->name;
  for (const std::string& joint : one.arm->joint_names()) {
    const auto own = read_channels(parameters, joint + "/channels", joint);
    one.arm_joints.push_back(own ? *own : robot_channels(joint, one.arm->channel));
  }
  all.push_back(std::move(one));
  return all;
}

}  // namespace

ChangeWatchSettings load_change_watch_settings(const ros::NodeHandle& private_handle) {
  Parameters parameters(private_handle);
  ChangeWatchSettings settings;
  if (!parameters.has("rig") && !parameters.has("rig_folder"))
    throw InvalidParameter("~rig", "''", "or ~rig_folder must be given");
  WatchSettings common;
  const Range lengths = Range::between(kShortest, 1e6);
  common.learn = parameters.number("learn", common.learn, lengths);
  common.window = parameters.number("window", common.window, lengths);
  common.check_interval = parameters.number("check_interval", common.check_interval, Range::positive());
  common.job_memory = parameters.number("job_memory", common.job_memory, Range::positive());
  common.healthy = parameters.texts("healthy", {});
  const double rate = false_alarm_rate(parameters.text("false_alarms", "1 per month"));
  const FileFolder folder("~folder", parameters.text("folder", default_folder()));
  const std::string history = read_history_folder(parameters);
  settings.queue = static_cast<int>(parameters.integer("queue", settings.queue, 1, 10'000'000));
  settings.stale = parameters.number("stale", settings.stale, Range::positive());
  settings.look_share = parameters.number("look_share", settings.look_share, Range::between(0.01, 1));
  parameters.allow("diagnostic_period");  // of diagnostic_updater
  std::vector<WatchSettings> all = watched(parameters);
  for (WatchSettings& what : all) {
    WatchSettings watch = common;
    watch.joint = std::move(what.joint);
    watch.arm = std::move(what.arm);
    watch.arm_joints = std::move(what.arm_joints);
    const std::string& name = watch.joint.joint;
    watch.healthy = parameters.texts(name + "/healthy", common.healthy);
    watch.learned = joint_path(folder.path(), name, "_healthy.csv");
    watch.changed = joint_path(folder.path(), name, "_changed.csv");
    if (!history.empty()) watch.log = joint_path(history, name, "_changes.csv");
    watch.rate = diagnosis::rate_of_look(rate, watch.window, watch.check_interval, all.size());
    settings.joints.push_back(std::move(watch));
  }
  parameters.finish();
  folder.create();
  return settings;
}

}  // namespace backlash::ros_bridge
