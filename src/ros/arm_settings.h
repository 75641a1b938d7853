// SPDX-License-Identifier: BSD-3-Clause
// Private parameters of the simulator node where ~rig is the file of an arm.
#pragma once

#include "backlash_diagnosis/ros/parameters.h"
#include "backlash_diagnosis/ros/simulator_settings.h"

namespace backlash::ros_bridge {

/// All but those that a joint by itself has too. Throws InvalidParameter, MissingInput, BadData.
ArmSettings read_arm_settings(Parameters& parameters);

}  // namespace backlash::ros_bridge
