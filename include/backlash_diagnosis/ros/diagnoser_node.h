// SPDX-License-Identifier: BSD-3-Clause
// The node `diagnoser`: joint_states in, distributions, estimates and answers out.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <backlash_diagnosis/BuildCurveAction.h>
#include <backlash_diagnosis/Diagnose.h>
#include <backlash_diagnosis/GetCurve.h>
#include <backlash_diagnosis/SetBaseline.h>
#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/DiagnosedJointLiveConfig.h"
#include "backlash_diagnosis/DiagnoserLiveConfig.h"
#include "backlash_diagnosis/base/file_folder.h"
#include "backlash_diagnosis/ros/joint_diagnostics.h"
#include "backlash_diagnosis/ros/joint_inputs.h"
#include "backlash_diagnosis/ros/joint_monitor.h"
#include "backlash_diagnosis/ros/live_server.h"
#include "backlash_diagnosis/ros/trace_server.h"

namespace backlash::ros_bridge {

/// Parameters of the node, validated.
struct DiagnoserSettings {
  std::vector<MonitorSettings> joints;
  int queue = 20000;  // messages waiting at most
  DiagnosticsSettings diagnostics;
  std::string folder;              // in which goals may name files
  std::string history;             // folder with a file per joint; empty: none is kept
  double history_interval = 60;    // s
  double job_memory = kJobMemory;  // GB that the process of an action may hold
  bool waveform = true;            // fitted in the background
};

/// Throws InvalidParameter, BadData, MissingInput.
DiagnoserSettings load_diagnoser_settings(const ros::NodeHandle& private_handle);

/// Text for --help: parameters, topics, services.
const char* diagnoser_help();

class DiagnoserNode {
 public:
  DiagnoserNode(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                DiagnoserSettings settings);
  ~DiagnoserNode();

  /// Serves until ROS shuts down.
  void run();

 private:
  using CurveServer = actionlib::SimpleActionServer<backlash_diagnosis::BuildCurveAction>;
  using Live = backlash_diagnosis::DiagnoserLiveConfig;
  using JointLive = backlash_diagnosis::DiagnosedJointLiveConfig;

  /// All that belongs to a joint; its address stays.
  struct Joint {
    std::unique_ptr<JointMonitor> monitor;
    std::unique_ptr<JointHistory> history;  // null where none is kept
    std::unique_ptr<JointDiagnostics> diagnostics;
    std::unique_ptr<LiveServer<JointLive>> live;
  };

  void on_joint_state(std::size_t topic, const sensor_msgs::JointState& message);
  void publish(const Joint& joint, const PeriodReport& report);
  void publish(const Joint& joint, const ros::Time& stamp, const diagnosis::Diagnosis& diagnosis);
  bool on_diagnose(backlash_diagnosis::Diagnose::Request& request,
                   backlash_diagnosis::Diagnose::Response& response);
  bool on_set_baseline(backlash_diagnosis::SetBaseline::Request& request,
                       backlash_diagnosis::SetBaseline::Response& response);
  /// Takes the diagnosis of all samples that are kept as baseline, and writes it to the baseline's file; the
  /// second deletes both.
  void set_baseline(Joint& joint, backlash_diagnosis::SetBaseline::Response& response);
  void clear_baseline(JointMonitor& monitor, backlash_diagnosis::SetBaseline::Response& response);
  bool on_get_curve(backlash_diagnosis::GetCurve::Request& request,
                    backlash_diagnosis::GetCurve::Response& response);
  void on_build_curve(const backlash_diagnosis::BuildCurveGoalConstPtr& goal);
  diagnosis::MonitoringCurve built_curve(const backlash_diagnosis::BuildCurveGoal& goal,
                                         JointMonitor& monitor);
  void advertise();
  void add_joint(MonitorSettings settings, const DiagnoserSettings& common);
  void serve_live(const DiagnoserSettings& settings);
  void apply(const Live& wanted);
  /// Throws InvalidParameter.
  void apply(Joint& joint, const JointLive& wanted);
  void write_histories();

  /// A joint; with an empty name the only one. Null with the reason in `why`.
  Joint* find(const std::string& joint, std::string& why);
  JointMonitor* find_monitor(const std::string& joint, std::string& why);

  ros::NodeHandle handle_, private_handle_;
  FileFolder folder_;
  double job_memory_;                // GB
  BackgroundFits fits_;              // of all joints
  std::vector<Joint> joints_;        // as many as at the start, so that their addresses stay
  JointInputs inputs_;               // of the same joints
  std::vector<std::string> topics_;  // of inputs_, resolved
  ros::CallbackQueue sample_queue_;  // samples have a thread of their own, services never hold them up
  std::vector<ros::Subscriber> subscribers_;  // of inputs_.topics()
  ros::Publisher distributions_, estimates_;
  std::vector<ros::ServiceServer> services_;
  std::unique_ptr<CurveServer> curve_server_;
  std::unique_ptr<TraceServer> trace_server_;
  diagnostic_updater::Updater updater_;
  std::unique_ptr<LiveServer<Live>> live_;
};

}  // namespace backlash::ros_bridge
