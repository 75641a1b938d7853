// SPDX-License-Identifier: BSD-3-Clause
// Whether the motion of a record is that of a joint whose output is locked, as the rig file says.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {

/// Most travel of the motor [rad, >= 0] against a locked output, for play b [rad] and elastic deflection e
/// [rad] of one flank under the largest torque. When the torque changes sign, it pushes the motor from rest
/// on the one flank, whose spring gives its energy too, across b into the other: x^2 / 2 = e (e + b + x) +
/// e^2 / 2. So at either end x = e + sqrt(4 e^2 + 2 e b), and the travel is b + 2 x. Source: energy; friction
/// and damping make it less.
double most_locked_travel(double play, double deflection);

/// What a locked output allows, at the axis of motor_position.
struct DeclaredLock {
  std::function<double(double torque)> elastic_deflection;  ///< rad, of one flank at a torque > 0 [N m]
  double play = kNaN;  ///< rad, > 0: that from which the joint must stop; NaN: not known, nothing is checked
};

/// Why the record is not that of a locked joint, in plain words; nothing where it may be, or where the record
/// has no motor_position and motor_velocity, or no torque. Play may be thrice and elastic deflection twice
/// the declared one before it is refused.
std::optional<std::string> lock_contradicted(const record::Record& record, const DeclaredLock& lock);

}  // namespace backlash::diagnosis
