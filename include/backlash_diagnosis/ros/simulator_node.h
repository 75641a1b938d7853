// SPDX-License-Identifier: BSD-3-Clause
// The simulator as a ROS node: simulated joints or an arm, paced by a clock.
//
// One thread: it publishes the samples that are due, then calls the callbacks, and so on. So a service or a
// torque acts from the time of the last published sample on.
#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>
#include <std_srvs/Trigger.h>

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/ros/pacer.h"
#include "backlash_diagnosis/ros/simulated_machine.h"
#include "backlash_diagnosis/ros/simulator_settings.h"

namespace backlash::ros_bridge {

class SimulatorNode {
 public:
  /// Throws what read_simulator_settings() throws. Topics and services are there afterwards.
  SimulatorNode(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle);
  SimulatorNode(const SimulatorNode&) = delete;  // callbacks refer to this object
  SimulatorNode& operator=(const SimulatorNode&) = delete;

  /// Simulates until the duration is over or ROS shuts down. Returns 0; throws IntegrationError.
  int run();

 private:
  using WallClock = std::chrono::steady_clock;
  using Nanoseconds = std::chrono::nanoseconds;

  void advertise();
  bool wait_for_start();
  void start();
  Nanoseconds elapsed() const;  // on the clock that sets the pace, since sample 0 was due
  void publish_burst();
  void publish_sample();
  void publish_clock(const ros::Time& now);
  ros::Time stamp(long sample) const;
  bool finished() const { return settings_.samples > 0 && published_ >= settings_.samples; }
  bool ros_time_went_back() const;
  void warn_if_behind();
  void serve(Nanoseconds longest);
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);

  bool reset(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);

  SimulatorSettings settings_;
  Pacer pacer_;
  bool follows_ros_time_;  // an external /clock sets the pace
  bool started_ = false;
  ros::Time origin_;  // stamp of sample 0
  WallClock::time_point start_;
  long published_ = 0;  // samples, also the number of the next one; a reset does not set it back
  ros::Duration clock_step_;
  ros::Time next_clock_;
  Nanoseconds lag_{0};
  WallClock::time_point next_warning_, next_report_;
  WallClock::time_point last_report_;
  long reported_ = 0;  // samples at the last report

  ros::NodeHandle handle_, private_handle_;
  std::vector<std::unique_ptr<SimulatedMachine>> machines_;
  std::map<std::string, ros::Publisher> joint_states_;  // by topic
  ros::Publisher clock_;
  ros::ServiceServer reset_;
  diagnostic_updater::Updater updater_;
};

}  // namespace backlash::ros_bridge
