// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "backlash_diagnosis/arm/motion.h"

namespace backlash::tools {

/// The joints of the rig out of a .csv with columns JOINT/channel, or of a .bag with stock joint_states
/// (position, velocity, effort as the rig's channel). Throws as read_record().
arm::ArmRecord read_arm_record(const std::string& path, const arm::ArmRig& rig);

}  // namespace backlash::tools
