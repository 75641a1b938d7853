// SPDX-License-Identifier: BSD-3-Clause
// The commands that know joints and arms, for the rig file of an arm. Each returns the exit code.
#pragma once

#include "tools/common/command_line.h"
#include "tools/common/record_door.h"

namespace backlash::tools {

int simulate_arm(const Arguments& arguments);
/// Outputs are checked already.
int check_arm(const Arguments& arguments);
int convert_arm(const Arguments& arguments);
/// All its joints in one run. The exit code is that of the worst.
int diagnose_arm(const Arguments& arguments, RecordDoor& door);
/// Outputs are checked already. Throws CannotIdentify.
int identify_arm(const Arguments& arguments, RecordDoor& door);
/// The torque constant of a single joint by known weights; the same.
int weigh_joint(const Arguments& arguments, RecordDoor& door);
/// What was identified, in the robot's own URDF. Outputs are checked already.
int export_arm(const Arguments& arguments);
/// Outputs are checked already.
int trace_arm_residual(const Arguments& arguments, RecordDoor& door);

}  // namespace backlash::tools
