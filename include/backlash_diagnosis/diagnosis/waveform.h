// SPDX-License-Identifier: BSD-3-Clause
// Play from the waveform itself: the machine's equations of motion, with the play and all uncertain values of
// the machine and its sensors free within what is known of them, are fitted to the sensor's torque, and to
// the motor's position where that is recorded, about the reversals of a square-wave torque:
//
//   Jm qm'' = tau - cm qm' - dry(qm') - T        T = Ki (qm - qp) + Ci (qm' - qp')
//   Jp qp'' = T - F rb                           F = K d^1.5 max(0, 1 + 3/2 alpha d')
//   Jg qg'' = F rb - Ko qg - Co qg'              d = |rb (qp - qg)| - backlash / 2
//
// (Sarkar, Ellis and Moore 1997, Eqs. 1 to 12; the output is locked). No declared value has to be right, only
// its spread. What the prior spreads below are is a choice: what data sheets and drawings are good for.
//
// Symmetry of torque alone: with inertias, damping and stiffnesses times c, the contact's K times c^2.5 and
// its alpha times c, and the backlash divided by c, the torque is the same. From torque alone the play is
// known no better than one of these scales, mostly the stiffness of the torque sensor. An angle ends that.
//
// Needs motor_torque (square wave) and sensor_torque, evenly sampled, at least three samples in a cycle of
// the motor against the pinion; uses motor_position.
//
// Interval, 95 %: two standard errors of the fit with its priors, on the logarithm of the play, widened by
// what the residual has of structure, and not below what equations of rigid flanks can tell (kFinest).
#pragma once

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {

/// The declared machine. All at the motor_position axis, as the rig file gives them.
struct WaveformSettings {
  double base_radius = kNaN;                              ///< rb, m, > 0
  double motor_inertia = kNaN;                            ///< Jm, kg m^2, > 0, with its share of the sensor
  double pinion_inertia = kNaN, gear_inertia = kNaN;      ///< Jp, Jg, kg m^2, > 0
  double motor_damping = kNaN;                            ///< cm, N m s/rad, > 0
  double dry_friction = 0;                                ///< N m, of the motor, >= 0
  double sensor_stiffness = kNaN, sensor_damping = kNaN;  ///< Ki, N m/rad, Ci, N m s/rad, > 0
  double output_stiffness = kNaN, output_damping = kNaN;  ///< Ko, N m/rad, Co, N m s/rad, > 0
  double contact_stiffness = kNaN;                        ///< K, N/m^1.5, > 0
  double contact_loss = kNaN;                             ///< alpha, s/m, > 0
  bool sensor_with_damper = false;                        ///< the sensor shows T and not Ki (qm - qp)
};

/// How well the values above are known: one standard deviation, of the logarithm where it says "factor".
/// Choices.
struct WaveformSpread {
  static constexpr double kStiffness = 0.09;     ///< factor, of the torque sensor: 18 % at 95 %
  static constexpr double kInertia = 0.15;       ///< factor: 30 % at 95 %, by a drawing
  static constexpr double kMotorDamping = 0.5;   ///< factor: 2.7 at 95 %
  static constexpr double kSensorDamping = 1.3;  ///< factor: 13 at 95 %, no data sheet has it
  static constexpr double kMesh = 0.46;          ///< factor: 2.5 at 95 %, contact and output coupling
  static constexpr double kDryFriction = 0.1;    ///< of the torque's level
  static constexpr double kFrictionSpeed = 1.5;  ///< factor, about kSlow
  static constexpr double kSlow = 0.02;          ///< rad/s, speed at which dry friction changes its sign
  static constexpr double kGain = 0.04;          ///< factor, of the torque sensor
  static constexpr double kBias = 0.1;           ///< of the torque's level, of the torque sensor
  static constexpr double kLag = 3e-4;    ///< s, of the torque sensor: delay, and time constant of its filter
  static constexpr double kDrive = 0.04;  ///< of the torque's level: cogging, gravity
  static constexpr double kDriveSlope = 0.002;  ///< of Ki: cogging within the small travel
};

/// Throws InvalidParameter for settings outside the ranges above. Answers by status:
///   insufficient_data  a channel is missing; too few reversals
///   out_of_domain      no square wave, uneven or too coarse samples; the equations do not fit the record, or
///                      only with values far from the declared ones
///   ambiguous          two plays fit alike
///   below_range        the interval, which is given, holds 0
Estimate estimate_waveform(const record::Record& record, const WaveformSettings& settings);

}  // namespace backlash::diagnosis
