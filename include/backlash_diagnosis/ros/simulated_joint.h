// SPDX-License-Identifier: BSD-3-Clause
// One joint of the simulator node: a Simulation with its topics and services.
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>
#include <ros/subscriber.h>
#include <std_msgs/Float64.h>

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/SetBacklash.h"
#include "backlash_diagnosis/SetRig.h"
#include "backlash_diagnosis/SimulatedJointLiveConfig.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "backlash_diagnosis/ros/live_server.h"
#include "backlash_diagnosis/ros/simulator_settings.h"
#include "backlash_diagnosis/simulation/simulation.h"

namespace backlash::ros_bridge {

class SimulatedJoint {
 public:
  /// Topics rig_description, true_backlash and torque_command are relative to `handle`, the services
  /// set_backlash and set_rig and the live parameters to `private_handle`.
  SimulatedJoint(const JointSettings& settings, const ros::NodeHandle& handle,
                 const ros::NodeHandle& private_handle);
  SimulatedJoint(const SimulatedJoint&) = delete;  // callbacks refer to this object
  SimulatedJoint& operator=(const SimulatedJoint&) = delete;

  /// Where its samples go: joint_states, or what the rig file's `channels` say.
  std::vector<std::string> topics() const;
  /// The next sample, added to the message of each of its topics.
  void step(std::map<std::string, sensor_msgs::JointState>& messages);
  /// At rest in the middle of the gap, backlash as at the start.
  void reset();
  std::string true_backlash() const;  // with its unit, for people
  const simulation::Simulation& simulation() const { return simulation_; }

 private:
  using Live = backlash_diagnosis::SimulatedJointLiveConfig;

  void publish_true_backlash();
  /// Throws InvalidParameter, and changes nothing then.
  void change_backlash(double backlash);
  Live live() const;
  void apply(const Live& wanted);
  bool set_backlash(backlash_diagnosis::SetBacklash::Request& request,
                    backlash_diagnosis::SetBacklash::Response& response);
  bool set_rig(backlash_diagnosis::SetRig::Request& request, backlash_diagnosis::SetRig::Response& response);
  void set_torque(const std_msgs::Float64& message);

  std::string name_;
  bool angular_;
  JointNames names_;
  std::map<std::string, JointStateWriter> writers_;  // by topic, of a rig file that says where; else empty
  simulation::Simulation simulation_;
  long torque_samples_;  // that a torque_command is held for; 0: for ever
  long torque_age_ = 0;  // samples since the last one
  std::chrono::steady_clock::time_point next_torque_warning_;
  ros::NodeHandle handle_;
  ros::Publisher rig_description_, true_backlash_;
  ros::Subscriber torque_command_;
  ros::ServiceServer set_backlash_, set_rig_;
  std::unique_ptr<LiveServer<Live>> live_;
};

}  // namespace backlash::ros_bridge
