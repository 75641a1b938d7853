// SPDX-License-Identifier: BSD-3-Clause
// What position_difference reads from a record before any fit: torque and both positions at the motor's axis,
// the delay of the load's encoder, and whether a machine can have moved like that.
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
/// unknown error. A small skew acts on the flanks like a friction of the motor.
signal::Measured clear_skew(const TwoEncoders& motion, double inertia);

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
