// SPDX-License-Identifier: BSD-3-Clause
// Private parameters of the simulator node.
#pragma once

#include <ros/node_handle.h>

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/ros/simulated_machine.h"

namespace backlash::ros_bridge {

/// One simulated joint.
struct JointSettings {
  rig_file::RigFile file;     // with the parameters that override it applied to `rig` and `simulation`
  std::string description;    // the rig file's text after a comment line: its source and what overrides it
  double torque_timeout = 0;  // s, simulated, after which a torque_command is zero again; 0: held for ever
};

struct SimulatorSettings {
  std::optional<ArmToSimulate> arm;
  std::vector<JointSettings> joints;  // without arm at least one, all with the same sampling rate
  bool named_joints = false;  // several, or a list of one: each has topics and services below its own name
  std::string rig;            // name of the (first) rig
  double sampling_rate;       // Hz
  double real_time_factor;    // simulated per wall time; 0: as fast as possible
  long samples;               // to publish before the node ends; 0: endless
  bool publish_clock;
  bool wait_for_subscriber;
  double diagnostic_period;  // s, wall time
};

/// Reads and checks all private parameters of the node; simulator_help() lists them. Throws InvalidParameter,
/// MissingInput or BadData with a message that names the parameter.
SimulatorSettings read_simulator_settings(const ros::NodeHandle& private_handle);

/// The node's parameters, topics and services for `--help`.
const char* simulator_help();

}  // namespace backlash::ros_bridge
