// SPDX-License-Identifier: BSD-3-Clause
// Private parameters of the simulator node where ~rig is the file of an arm.
#pragma once

#include <string>

#include "backlash_diagnosis/geared_arm/geared_arm.h"
#include "backlash_diagnosis/ros/parameters.h"

namespace backlash::ros_bridge {

/// A simulated arm.
struct ArmSettings {
  geared_arm::GearedArm arm;  // with the parameters that override its file
  std::string description;    // its text after a comment line: its source and what overrides it
  std::string urdf;           // text
  bool set_robot_description = true;
  double torque_timeout = 0;  // s, simulated, after which a torque_command is zero again; 0: held for ever
};

/// All but those that a joint by itself has too. Throws InvalidParameter, MissingInput, BadData.
ArmSettings read_arm_settings(Parameters& parameters);

}  // namespace backlash::ros_bridge
