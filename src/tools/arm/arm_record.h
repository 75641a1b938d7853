// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/arm/motion.h"
#include "tools/common/record_door.h"

namespace backlash::tools {

/// The joints of the rig out of a .csv with columns JOINT/channel, or of a .bag with stock joint_states
/// (position, velocity, effort as the rig's channel). Their times count from the first one's time 0. Throws
/// as read_record().
std::vector<record::JointRecord> read_joints(const std::string& path, const arm::ArmRig& rig);

/// The same, as far as it can be used (record_door.h).
arm::ArmRecord admitted_arm_record(const std::string& path, const arm::ArmRig& rig, RecordDoor& door);

}  // namespace backlash::tools
