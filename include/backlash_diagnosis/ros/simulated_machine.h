// SPDX-License-Identifier: BSD-3-Clause
// What the simulator node steps and publishes: a joint by itself, or an arm whose joints advance together.
#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <sensor_msgs/JointState.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/simulation/integrator.h"

namespace backlash::ros_bridge {

class SimulatedMachine {
 public:
  virtual ~SimulatedMachine() = default;

  /// Where its samples go.
  virtual std::vector<std::string> topics() const = 0;
  /// Computes the next sample and adds it to the message of each of its topics. Throws IntegrationError.
  virtual void step(std::map<std::string, sensor_msgs::JointState>& messages) = 0;
  /// Back to rest, with the backlash of the start.
  virtual void reset() = 0;

  /// For people: what is simulated, by which file.
  virtual std::string title() const = 0;
  virtual std::string true_backlash() const = 0;  // with its unit, for people
  virtual simulation::IntegratorStatistics statistics() const = 0;
};

class Parameters;

/// An arm that is to be simulated: the room ros_arm reads and makes it, and is loaded only then.
struct ArmToSimulate {
  std::string rig;           // name
  double sampling_rate = 0;  // Hz
  std::function<std::unique_ptr<SimulatedMachine>(const ros::NodeHandle& handle,
                                                  const ros::NodeHandle& private_handle)>
      make;
};

/// Of ros_arm: reads ~rig and what overrides it. `torque_timeout` [s] as of a joint. Throws InvalidParameter,
/// MissingInput, BadData.
extern "C" void backlash_read_arm(Parameters& parameters, double torque_timeout, ArmToSimulate& arm);

/// Latched, on rig_description.
ros::Publisher publish_rig_description(const ros::NodeHandle& handle, const std::string& description);

constexpr const char* kJointStates = "joint_states";  // where the rig file names no topic

}  // namespace backlash::ros_bridge
