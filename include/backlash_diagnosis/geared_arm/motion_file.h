// SPDX-License-Identifier: BSD-3-Clause
// A planned motion as a file, and how a simulated arm or any controller follows it.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/geared_arm/motion_plan.h"

namespace backlash::geared_arm {

/// The plan as YAML, with all figures that lead to it.
std::string motion_text(const MotionPlan& plan);

/// What of such a file says how to move.
struct PlannedMotion {
  std::string rig, source;  // name of the rig, path of the file
  std::vector<std::string> joints;
  std::vector<simulation::FourierMotion> motions;  // one per joint
};

/// Throws MissingInput, BadData (file, line, key, value, limit).
PlannedMotion read_motion(const std::string& path);

/// Lets the position loops of a simulated arm follow the motion, each joint from its start. Throws BadData
/// where the joints are others, or one that moves has no loop (an excitation `moves`, whose controller it
/// is).
void follow(GearedArm& arm, const PlannedMotion& motion);

/// time [s], and of each joint JOINT/reference_position [rad], JOINT/reference_velocity [rad/s],
/// JOINT/reference_acceleration [rad/s^2], JOINT/mesh_torque [N m] (T of geared_arm/play.h): the approach and
/// one period, from rest to rest, `rate` [Hz] samples a second. Throws InvalidParameter.
std::string trajectory_csv(const GearedArm& arm, const MotionPlan& plan, double rate);

}  // namespace backlash::geared_arm
