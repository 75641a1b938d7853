// SPDX-License-Identifier: BSD-3-Clause
// One joint of the simulator node: a Simulation with its topics and services.
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>

#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/SetRig.h"
#include "backlash_diagnosis/ros/joint_controls.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "backlash_diagnosis/ros/simulated_machine.h"
#include "backlash_diagnosis/ros/simulator_settings.h"
#include "backlash_diagnosis/simulation/simulation.h"

namespace backlash::ros_bridge {

class SimulatedJoint : public SimulatedMachine {
 public:
  /// Topic rig_description and those of JointControls are relative to `handle`, the services set_backlash and
  /// set_rig and the live parameters to `private_handle`.
  SimulatedJoint(const JointSettings& settings, const ros::NodeHandle& handle,
                 const ros::NodeHandle& private_handle);
  SimulatedJoint(const SimulatedJoint&) = delete;  // callbacks refer to this object
  SimulatedJoint& operator=(const SimulatedJoint&) = delete;

  /// joint_states, or what the rig file's `channels` say.
  std::vector<std::string> topics() const override;
  void step(std::map<std::string, sensor_msgs::JointState>& messages) override;
  /// In the middle of the gap.
  void reset() override;
  std::string title() const override { return title_; }
  std::string true_backlash() const override { return controls_.true_backlash(); }
  simulation::IntegratorStatistics statistics() const override { return simulation_.plant().statistics(); }

 private:
  JointAccess access(const JointSettings& settings);
  bool set_rig(backlash_diagnosis::SetRig::Request& request, backlash_diagnosis::SetRig::Response& response);

  std::string name_, title_;
  JointNames names_;
  std::map<std::string, JointStateWriter> writers_;  // by topic, of a rig file that says where; else empty
  simulation::Simulation simulation_;
  JointControls controls_;
  ros::Publisher rig_description_;
  ros::ServiceServer set_rig_;
};

}  // namespace backlash::ros_bridge
