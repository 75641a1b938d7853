// SPDX-License-Identifier: BSD-3-Clause
// Parameters of the node `diagnoser`.
#include "backlash_diagnosis/ros/diagnoser_node.h"
#include "backlash_diagnosis/ros/monitor_settings.h"
#include "backlash_diagnosis/ros/node_folders.h"

namespace backlash::ros_bridge {
const char* diagnoser_help() {
  return R"(diagnoser: estimates the backlash of geared joints from joint torque and position

usage: rosrun backlash_diagnosis diagnoser [_PARAMETER:=VALUE ...] [NAME:=REMAPPED ...]

parameters (private)
  rig       path of the rig file; default: the built-in rig of Sarkar et al. (1997)
  rig_folder  folder with a rig file for each joint of a robot, instead of rig: all are watched
  curve     path of a monitoring curve; default: built from the rig at the rate of the messages
  joints    list of joint names; default: the joint of the rig file, or all of rig_folder
  channels/CHANNEL/...   topic, name, field, scale, offset: where the robot publishes that channel, as
            `channels` of the rig file, and instead of them
  limits    path of a file with limits to grade by (schema_version and the map of diagnosis.limits in a
            rig file); default: the rig file's
  baseline  path of the baseline of the healthy machine: read at the start where it exists, written by
            ~set_baseline, removed where that clears it; default: a baseline lasts as long as the node
  JOINT/rig, JOINT/channels, JOINT/curve, JOINT/limits, JOINT/baseline   the same for one of several
            joints
  window    whole periods that the published estimates look back; default 5
  estimate_interval   s at least from one published estimate to the next, by their stamps; default 0.25;
            0: each period
  keep      s of samples kept for the service; default 60
  queue     messages waiting at most; default 20000
  stale     s of wall time without a message before /diagnostics says so; default 2
  hold      s that a level on /diagnostics must be better before it falls; default 5
  latency_limit   s from stamp to arrival before /diagnostics warns; default 1
  history   folder, which must exist, for a file JOINT.csv with the estimates over months, and their
            trend on /diagnostics; default: none is kept
  history_interval   s at least from one entry to the next, by the stamps; default 60
  job_memory   GB that the process of an action may use, and that which builds a missing curve;
            default 4
  waveform  whether the estimator waveform is fitted, in the background at the lowest priority as
            gap_traverse is; default true
  folder    the only folder in which goals of actions may name files, relative to it or absolute;
            default: backlash_diagnosis in ROS_HOME (~/.ros)

subscribes
  joint_states             sensor_msgs/JointState: JOINT_motor, JOINT_sensor, JOINT_load,
                           JOINT_current and JOINT_accelerometer (A and rad/s^2 as effort);
                           other topics and names where the rig file's `channels` say so
publishes
  amplitude_distribution   backlash_diagnosis/AmplitudeDistribution, each whole period
  backlash_estimate        backlash_diagnosis/BacklashEstimate, one per method, each ~estimate_interval
  /diagnostics             diagnostic_msgs/DiagnosticArray
services
  ~diagnose  ~set_baseline  ~get_curve
  ~live, ~JOINT/live       dynamic_reconfigure while it runs: window, estimate_interval, stale, hold,
                           latency_limit; limits of a joint. What is wrong is refused: see `refused`
actions
  ~build_curve             backlash_diagnosis/BuildCurve
  ~trace_residual          backlash_diagnosis/TraceResidual: what the rig's model lacks, from records
)";
}

DiagnoserSettings load_diagnoser_settings(const ros::NodeHandle& private_handle) {
  Parameters parameters(private_handle);
  DiagnoserSettings settings;
  MonitorSettings defaults;
  defaults.window = static_cast<int>(parameters.integer("window", 5, 1, 1'000'000));
  defaults.estimate_interval = parameters.number("estimate_interval", 0.25, Range::not_negative());
  defaults.keep = parameters.number("keep", 60, Range::positive());
  settings.queue = static_cast<int>(parameters.integer("queue", 20000, 1, 10'000'000));
  settings.diagnostics.stale = parameters.number("stale", 2, Range::positive());
  settings.diagnostics.hold = parameters.number("hold", 5, Range::not_negative());
  settings.diagnostics.latency_limit = parameters.number("latency_limit", 1, Range::positive());
  settings.folder = parameters.text("folder", default_folder());
  settings.history = read_history_folder(parameters);
  settings.history_interval = parameters.number("history_interval", 60, Range::not_negative());
  settings.job_memory = parameters.number("job_memory", kJobMemory, Range::positive());
  settings.waveform = parameters.boolean("waveform", true);
  parameters.allow("live");
  parameters.allow("diagnostic_period");  // of diagnostic_updater
  settings.joints = load_monitors(parameters, defaults);
  parameters.finish();
  return settings;
}

}  // namespace backlash::ros_bridge
