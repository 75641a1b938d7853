// SPDX-License-Identifier: BSD-3-Clause
// The node `change_watch`: joint_states in, changes of the joints since they were commissioned out.
#pragma once

#include <backlash_diagnosis/ChangeReport.h>
#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "backlash_diagnosis/ros/arm/joint_watch.h"
#include "backlash_diagnosis/ros/joint_inputs.h"

namespace backlash::ros_bridge {

/// Parameters of the node, validated.
struct ChangeWatchSettings {
  std::vector<WatchSettings> joints;
  int queue = 20000;      // messages waiting at most
  double stale = 2;       // s of wall time without a message
  double look_share = 1;  // - fraction of the time that looks may run
};

/// Throws InvalidParameter, BadData, MissingInput, CannotWrite (the folder of what is learned).
ChangeWatchSettings load_change_watch_settings(const ros::NodeHandle& private_handle);

/// "1 per month" as 1/h; units hour, day, week, month (of 30 days) and year. Throws InvalidParameter.
double false_alarm_rate(const std::string& text);

/// Text for --help.
const char* change_watch_help();

class ChangeWatchNode {
 public:
  ChangeWatchNode(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                  const ChangeWatchSettings& settings);
  ~ChangeWatchNode();

  /// Serves until ROS shuts down.
  void run();

 private:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;

  void on_joint_state(std::size_t topic, const sensor_msgs::JointState& message);
  void look();
  bool pause_after(double seconds);
  void publish(const std::vector<diagnosis::KnownChange>& news, const JointWatch& of);
  void describe(const JointWatch& joint, Status& status) const;

  ros::NodeHandle handle_;
  double stale_;  // s
  double look_share_;
  std::vector<std::unique_ptr<JointWatch>> joints_;  // as many as at the start
  JointInputs inputs_;                               // of all joints
  struct Place {
    std::size_t watch, joint;  // of an arm
  };
  std::vector<Place> places_;        // of the joints of inputs_
  std::vector<std::string> topics_;  // of inputs_, resolved
  ros::CallbackQueue sample_queue_;  // samples have a thread of their own
  std::vector<ros::Subscriber> subscribers_;
  ros::Publisher changes_;
  diagnostic_updater::Updater updater_;
  std::mutex mutex_;
  std::condition_variable due_changed_;
  bool due_ = false, stop_ = false;
  std::thread looks_;  // last: it uses all of the others
};

}  // namespace backlash::ros_bridge
