// SPDX-License-Identifier: BSD-3-Clause
// Whether a record counts torque, positions and time as the rig file says. One that does not is that of no
// machine; what a fit makes of it would blame the rig file.
#pragma once

#include <vector>

#include "backlash_diagnosis/record/declared_motion.h"
#include "backlash_diagnosis/record/finding.h"

namespace backlash::record {

/// Columns at the load side of the reduction, of equal length, evenly sampled; `load` may be empty.
struct DrivenMotion {
  double interval = 0;                              // s
  const std::vector<double>&torque, &motor, &load;  // N m, rad, rad
};

/// Refused:
/// - sign: load_position of a load that moves with the motor turns against motor_position; motor_torque works
///   against the motion: what it would be spent on, tau = J a + d w + C sign(w) + c, has both a negative
///   inertia and friction that drives.
/// - scale: load_position travels less than 0.8 or more than 1.25 times as far; motor and load swing against
///   each other more than ten times between two samples: time in other units; the inertia that takes the
///   torque is what degrees, N mm or the other side of the reduction would make of the declared.
/// - swapped: motor_torque moves as a position would under motor_position as torque;
///   the load runs ahead of the motor that accelerates it.
/// - dead: the torque is a function of the position alone, as no friction and no acceleration would leave it.
/// Noted: scale, where the inertia is more than ten times what is declared, or less than a tenth, and no unit
/// says why.
/// A machine whose load does not turn with the motor is not asked.
std::vector<Finding> sense_of(const DrivenMotion& motion, const DeclaredMotion& declared);

}  // namespace backlash::record
