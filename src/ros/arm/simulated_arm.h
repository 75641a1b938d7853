// SPDX-License-Identifier: BSD-3-Clause
// The arm of the simulator node: an ArmSimulation with the topics and services of its joints.
//
// Each message has all joints: JOINT, the name in the URDF, as a robot publishes it (position and velocity of
// the link, effort = torque of the motor, at the joint), then JOINT_motor and JOINT_load as
// record/channel_map.h.
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/SetRig.h"
#include "backlash_diagnosis/geared_arm/simulation.h"
#include "backlash_diagnosis/ros/joint_controls.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "backlash_diagnosis/ros/simulated_machine.h"
#include "ros/arm/arm_settings.h"

namespace backlash::ros_bridge {

class SimulatedArm : public SimulatedMachine {
 public:
  /// Topic rig_description is relative to `handle`, what JointControls has below the name of each joint,
  /// service set_rig to `private_handle`. Sets the parameter robot_description where it is wanted and there
  /// is none yet.
  SimulatedArm(const ArmSettings& settings, const ros::NodeHandle& handle,
               const ros::NodeHandle& private_handle);
  SimulatedArm(const SimulatedArm&) = delete;  // callbacks refer to this object
  SimulatedArm& operator=(const SimulatedArm&) = delete;

  std::vector<std::string> topics() const override { return {kJointStates}; }
  void step(std::map<std::string, sensor_msgs::JointState>& messages) override;
  void reset() override;
  std::string title() const override { return title_; }
  std::string true_backlash() const override;
  simulation::IntegratorStatistics statistics() const override { return simulation_.plant().statistics(); }

 private:
  JointAccess access(std::size_t joint);
  bool set_rig(backlash_diagnosis::SetRig::Request& request, backlash_diagnosis::SetRig::Response& response);

  std::string title_, folder_;  // folder_: of the rig file, where the URDF of another is looked for
  std::vector<JointNames> names_;
  arm::HeldJoints held_;  // published too: robot_state_publisher shows what stands on them
  geared_arm::ArmSimulation simulation_;
  std::deque<JointControls> controls_;  // cannot be moved
  ros::Publisher rig_description_;
  ros::ServiceServer set_rig_;
};

}  // namespace backlash::ros_bridge
