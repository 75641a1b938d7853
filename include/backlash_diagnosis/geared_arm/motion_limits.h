// SPDX-License-Identifier: BSD-3-Clause
// What a planned motion of an arm may ask of each joint.
#pragma once

#include <optional>
#include <vector>

#include "backlash_diagnosis/geared_arm/geared_arm.h"

namespace backlash::geared_arm {

struct MotionLimits {
  double lower = 0, upper = 0;  // rad
  double speed = 0;             // rad/s, > 0
  double acceleration = 0;      // rad/s^2, > 0
  double torque = 0;            // N m, > 0, of the motor, at the joint's side of the reduction
  double start = 0;             // rad, where the joint is before
};

/// The URDF's limit element, tighter where the rig file's `motion_limits` of the joint says so, which also
/// has the acceleration and, of a continuous joint, the position; `acceleration` [rad/s^2] where the file has
/// none. A joint that is held stays there. Throws MissingInput; BadData (file, line, key, value, limit) for a
/// limit that nobody states, one beyond the URDF's, a start outside.
std::vector<MotionLimits> load_motion_limits(const GearedArm& arm, std::optional<double> acceleration);

}  // namespace backlash::geared_arm
