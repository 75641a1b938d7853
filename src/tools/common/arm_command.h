// SPDX-License-Identifier: BSD-3-Clause
// identify, trace_residual and diagnose_record for the rig file of an arm.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/arm/motion.h"
#include "tools/common/command_line.h"

namespace backlash::tools {

/// The joints of the rig out of a .csv with columns JOINT/channel, or of a .bag with stock joint_states
/// (position, velocity, effort as the rig's channel). Throws as read_record().
arm::ArmRecord read_arm_record(const std::string& path, const arm::ArmRig& rig);

/// Both return the exit code. Outputs are checked already. identify_arm() throws CannotIdentify.
int identify_arm(const Arguments& arguments);
int trace_arm_residual(const Arguments& arguments);

}  // namespace backlash::tools
