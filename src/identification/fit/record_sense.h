// SPDX-License-Identifier: BSD-3-Clause
// Whether a record counts torque, positions and time as the rig file says. One that does not is that of no
// machine; what a fit makes of it would blame the rig file.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::identification {

/// Columns at the load side of the reduction, of equal length, evenly sampled; `load` may be empty.
struct RecordedMotion {
  std::string record;
  double interval = 0;                              // s
  const std::vector<double>&torque, &motor, &load;  // N m, rad, rad
};

/// Throws BadData, naming the record, where
/// - load_position of a load that moves with the motor turns against motor_position, or travels less than 0.8
///   or more than 1.25 times as far;
/// - motor_torque works against the motion: what it would be spent on, tau = J a + d w + C sign(w) + c, has
///   both a negative inertia and friction that drives;
/// - motor and load swing against each other more than ten times between two samples: time in other units.
/// A rig with a locked link, and one whose link does not follow the motor through one mesh, is not asked.
void require_sense(const RecordedMotion& motion, const model::Rig& load_side);

/// One where the inertia that takes the torque is more than ten times what is declared, or less than a tenth:
/// records in other units (degrees, N mm) are of such a machine.
std::vector<std::string> unit_warnings(const RecordedMotion& motion, const model::Rig& load_side);

}  // namespace backlash::identification
