// SPDX-License-Identifier: BSD-3-Clause
// The interface of one simulated joint while it runs, alone or in an arm: topics true_backlash and
// torque_command, service set_backlash, live parameters.
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>
#include <ros/subscriber.h>
#include <std_msgs/Float64.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "backlash_diagnosis/SetBacklash.h"
#include "backlash_diagnosis/SimulatedJointLiveConfig.h"
#include "backlash_diagnosis/ros/live_server.h"
#include "backlash_diagnosis/simulation/sensor_model.h"

namespace backlash::ros_bridge {

/// The joint of a simulation.
struct JointAccess {
  std::function<double()> backlash;
  std::function<void(double)> set_backlash;  // throws InvalidParameter, and changes nothing then
  std::function<void(double)> set_torque;    // N m, finite
  std::function<simulation::SensorModel&()> sensors;
};

class JointControls {
 public:
  struct Settings {
    std::string joint;
    const char* unit;       // of its backlash
    bool takes_torque;      // excitation `topic`
    double torque_timeout;  // s, simulated, after which a torque_command is zero again; 0: held for ever
    double sampling_rate;   // Hz
  };

  /// Topics are relative to `handle`, the service and the live parameters to `private_handle`.
  JointControls(Settings settings, JointAccess joint, const ros::NodeHandle& handle,
                const ros::NodeHandle& private_handle);
  JointControls(const JointControls&) = delete;  // callbacks refer to this object
  JointControls& operator=(const JointControls&) = delete;

  /// Before each sample: a torque_command that is too old is zero.
  void age_torque();
  /// Publishes the values in force after something else has changed them.
  void publish();
  std::string true_backlash() const;  // with its unit, for people

 private:
  using Live = backlash_diagnosis::SimulatedJointLiveConfig;

  void publish_true_backlash();
  void change_backlash(double backlash);
  Live live() const;
  void apply(const Live& wanted);
  bool set_backlash(backlash_diagnosis::SetBacklash::Request& request,
                    backlash_diagnosis::SetBacklash::Response& response);
  void set_torque(const std_msgs::Float64& message);

  Settings settings_;
  JointAccess joint_;
  long torque_samples_;  // that a torque_command is held for; 0: for ever
  long torque_age_ = 0;  // samples since the last one
  std::chrono::steady_clock::time_point next_torque_warning_;
  ros::NodeHandle handle_;
  ros::Publisher true_backlash_;
  ros::Subscriber torque_command_;
  ros::ServiceServer set_backlash_;
  std::unique_ptr<LiveServer<Live>> live_;
};

}  // namespace backlash::ros_bridge
