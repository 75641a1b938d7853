// SPDX-License-Identifier: BSD-3-Clause
// What position_difference reads of a record before any fit: torque and both positions at the motor's axis,
// how late the load's encoder is, and whether a machine can have moved like that.
#pragma once

#include <cstddef>
#include <vector>

#include "backlash_diagnosis/diagnosis/flank_windows.h"
#include "backlash_diagnosis/diagnosis/position_difference.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::diagnosis {

constexpr std::size_t kShortestWindow = 4;  // samples, half a window

/// Torque at the motor_position axis that distinguishes the flanks: one record's columns differ in what lies
/// between sensor and teeth.
struct FlankTorque {
  const std::vector<double>& values;
  double factor;        // to the motor_position axis
  bool behind = false;  // the gear: the motor's inertia is not between
};

FlankTorque torque_at_flanks(const record::Record& record, const PositionDifferenceSettings& settings);

TwoEncoders two_encoders(const record::Record& record, const PositionDifferenceSettings& settings);

double travelled(const std::vector<double>& values);

/// The load's position `skew` [s] earlier. Near breaks and ends, where it is not known, windows are broken.
TwoEncoders without_skew(TwoEncoders motion, double skew);

/// Skew of the encoders beside the declared one, where the record shows that it is not zero; else 0 with an
/// unknown error. The flanks hold a small one like a friction of the motor.
signal::Measured clear_skew(const TwoEncoders& motion, double inertia);

/// A load that travels farther than the deflection varies shows friction with both signs of its speed.
bool load_travels(const TwoEncoders& motion);

/// Between two walls no torque drives the motor faster than if it pushed over the whole travel. Positions
/// that jump are no positions: columns with exchanged names, or other units. `fastest` has thrice that speed,
/// and only moves over half the travel count, so that neither noise nor a wrong inertia matters; slow
/// sampling shows no jumps.
void require_possible(const TwoEncoders& motion, double inertia);

/// A torque that alternates throws the motor to and fro within each sample: teeth that push but never pull,
/// damping and dry friction then do not act on the recorded means.
void require_steady(const TwoEncoders& motion, double inertia);

}  // namespace backlash::diagnosis
