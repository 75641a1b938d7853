// SPDX-License-Identifier: BSD-3-Clause
// What position_difference reads from a record before any fit: torque and both positions at the motor's axis,
// on an even time base, and whether a machine can have moved like that.
#pragma once

#include <cstddef>
#include <vector>

#include "backlash_diagnosis/diagnosis/position_difference.h"
#include "backlash_diagnosis/record/record.h"
#include "flank_windows.h"

namespace backlash::diagnosis {

/// Torque at the motor_position axis that distinguishes the flanks: one record's columns differ in what lies
/// between sensor and teeth.
struct MotorTorque {
  const std::vector<double>& values;
  double factor;        // to the motor_position axis
  bool behind = false;  // the gear: the motor's inertia is not between
};

MotorTorque torque_at_flanks(const record::Record& record, const PositionDifferenceSettings& settings);

TwoEncoders two_encoders(const record::Record& record, const PositionDifferenceSettings& settings);

double travelled(const std::vector<double>& values);

/// The load's position `skew` [s] earlier. Near ends and lost samples it is not known.
TwoEncoders without_skew(TwoEncoders motion, double skew);

/// A load that travels farther than the deflection varies shows friction with both signs of its speed.
bool load_travels(const TwoEncoders& motion);

/// Between two walls the motor is never faster than if the largest torque pushed it over the whole travel.
/// Positions that jump faster than that are wrong: columns with exchanged names, or other units. `fastest` is
/// three times that speed, and only moves over half of the travel are tested, so that noise and a wrong
/// inertia do not matter. Slow sampling shows no jumps.
void require_possible(const TwoEncoders& motion, double inertia);

/// An alternating torque can throw the motor to and fro within each sample. The recorded means of position
/// and torque then do not obey the nonlinear laws of teeth and friction.
void require_steady(const TwoEncoders& motion, double inertia);

}  // namespace backlash::diagnosis
