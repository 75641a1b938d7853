// SPDX-License-Identifier: BSD-3-Clause
// A motor before a gap whose output is locked, from motor_torque and motor_position of any motion that comes
// to both flanks (inverse dynamics, load side of the reduction):
//
//   J a + c v + Fc sign(v) + offset + f(x - drift t) = torque
//   f(x) = F(x - x_plus) for x > x_plus, -F(x_minus - x) for x < x_minus, 0 between
//   backlash_angle = x_plus - x_minus
//
// F is the contact law of the rig file with its stiffness as an unknown; its exponent and its damping are as
// declared. An elastic output coupling behind a linear law is in series with it. What the terms of the rig
// add is taken as the file says it.
//
// Only samples count in which the motor surely slides: below that speed dry friction takes any value. Torque
// and every column go through the same zero-phase low-pass. Start: a grid of both edges over the travel, the
// rest linear; then Gauss-Newton (Levenberg-Marquardt) over everything.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct LockedOutput {
  signal::Measured inertia;         // kg m^2, of all that moves with the motor
  signal::Measured viscous;         // N m s/rad, of the motor
  signal::Measured coulomb;         // N m
  signal::Measured offset;          // N m, of the torque; friction that differs between the directions
  signal::Measured stiffness;       // of the contact law, in its unit
  signal::Measured backlash_angle;  // rad; < 0: both flanks touch at once, the gears are preloaded
  double centre = 0;          // rad, motor_position in the middle of the gap in the middle of the record
  signal::Measured drift;     // rad/s, of the position
  double cutoff = 0;          // Hz
  double relative_error = 0;  // norm(residual) / norm(torque - its mean), both filtered
  double floor = 0;           // of that, by the white noise of torque and position alone
  double interval = 0;        // s
  std::vector<double> measured, predicted;  // N m, filtered
  std::vector<char> counts;                 // samples that count
  std::vector<std::string> warnings;
};

/// Throws CannotIdentify where this rig cannot be served, with the reason.
void require_locked_output(const model::Rig& rig);

/// `record` and `rig` are those of the load side; values of the rig are what the terms, the damping of the
/// teeth and the coupling are taken from, and need not be near otherwise.
///
/// Standard errors: the largest of those from blocks of residuals as long as the motion of one direction and
/// shorter ones, times Student's t over the normal quantile; half a sample by which torque and position may
/// be apart; and where the model leaves more than 1.5 times the noise, what is left as if it followed each
/// value. Besides by how much the values move where an effect that the rig does not declare is fitted as well
/// and is clear beyond four standard deviations: friction that follows the load, a stiffness that hardens,
/// friction at low speed, a delay. `warnings` name it, and say where the torque shakes dry friction off.
///
/// Throws CannotIdentify where a channel is missing, the motor surely slides in fewer than 2 % of the samples
/// in either direction, a flank is not touched, or torque hardly follows the position.
LockedOutput identify_locked_output(const record::Record& record, const model::Rig& rig);

}  // namespace backlash::identification
