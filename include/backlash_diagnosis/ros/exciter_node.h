// SPDX-License-Identifier: BSD-3-Clause
// The node `exciter`: drives one joint through a test run by commanding torque, and keeps what it saw in a
// bag.
//
// Threads: one for states, one of the action that commands, and the main thread, which looks after the
// master, other publishers and signals. However a run ends, its last commands are zero.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <backlash_diagnosis/ExciteAction.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/file_folder.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/ros/joint_inputs.h"
#include "backlash_diagnosis/ros/run_bag.h"
#include "backlash_diagnosis/simulation/safe_drive.h"

namespace backlash::ros_bridge {

const char* exciter_help();

struct ExciterSettings {
  rig_file::RigFile file;
  simulation::DriveLimits limits;
  simulation::SafeDriveSettings drive;
  double rate = 200;  // Hz, of the commands
  bool dry_run = false;
  std::string folder;  // that bags are written to
};

/// Throws InvalidParameter: ranges, names, and each limit that is not given.
ExciterSettings read_exciter_settings(const ros::NodeHandle& private_handle);

class ExciterNode {
 public:
  ExciterNode(const ros::NodeHandle& handle, const ExciterSettings& settings);
  ~ExciterNode();
  ExciterNode(const ExciterNode&) = delete;  // callbacks refer to this object
  ExciterNode& operator=(const ExciterNode&) = delete;

  /// Serves the action until a signal or the loss of the master. Returns 0; 70 where the master was lost.
  int run();

 private:
  using Server = actionlib::SimpleActionServer<backlash_diagnosis::ExciteAction>;
  using Result = backlash_diagnosis::ExciteResult;

  void take(std::size_t topic, const sensor_msgs::JointState& message);
  void execute(const backlash_diagnosis::ExciteGoalConstPtr& goal);
  void drive(const backlash_diagnosis::ExciteGoal& goal, Result& result);
  void command_until_the_end(Result& result);
  void command(double torque, Result& result);
  void send_zeros(Result& result);
  void refuse_if_not_alone() const;
  void write_plan(const simulation::DrivePlan& plan, const std::string& path) const;
  void write_bag(const std::string& path, Result& result);
  void stop(const std::string& reason);
  std::string other_publisher() const;

  ExciterSettings settings_;
  ros::NodeHandle handle_;
  ros::CallbackQueue queue_;
  ros::Publisher command_;
  JointInputs inputs_;
  std::vector<ros::Subscriber> subscribers_;
  std::mutex mutex_;  // of what follows
  std::unique_ptr<simulation::SafeDrive> drive_;
  RunRecording recording_;
  ros::Time first_stamp_;
  std::string refused_;  // why no further goal may begin
  std::unique_ptr<ros::AsyncSpinner> states_;
  std::unique_ptr<Server> server_;
};

}  // namespace backlash::ros_bridge
