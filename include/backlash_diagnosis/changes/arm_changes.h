// SPDX-License-Identifier: BSD-3-Clause
// Since when an arm differs from what it was when it was commissioned: which joint, or what it carries. What
// the healthy chain takes is taken off each joint's torque; what is left is searched joint by joint as of a
// machine of one inertia, and beside that for effects that all joints show at once, whose scores add up:
// `payload` (the ten parameters of a body at a link) and `encoder_slip` of a joint.
//
// An arm that holds its pose shows pushes instead (arm/push.h): `external_torque`.
#pragma once

#include <vector>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/arm/motion.h"
#include "backlash_diagnosis/changes/changes.h"

namespace backlash::changes {

/// Throws CannotIdentify where no joint moves enough, BadData, Cancelled.
Changes detect_changes(const arm::ArmRig& rig, const std::vector<arm::ArmRecord>& healthy,
                       const arm::ArmRecord& record, const ChangeSettings& settings = {},
                       const Progress& progress = {});

}  // namespace backlash::changes
