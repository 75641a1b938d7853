// SPDX-License-Identifier: BSD-3-Clause
// Play from the waveform itself: the machine's equations of motion, with the play and all uncertain values of
// the machine and its sensors free within what is known of them, are fitted to the sensor's torque, and to
// the motor's position where that is recorded, about the reversals of the motor's torque:
//
//   Jm qm'' = tau - cm qm' - dry(qm') - T        T = Ki (qm - qp) + Ci (qm' - qp')
//   Jp qp'' = T - F rb                           F = max(0, K d^n (1 + 3/2 alpha d' + h sign(d')) + c d')
//   Jg qg'' = F rb - Ko qg - Co qg'              d = |rb (qp - qg)| - backlash / 2
//
// (Sarkar, Ellis and Moore 1997, Eqs. 1 to 12, whose output is locked). Where the link is free, its inertia
// stands for spring and damper of the output, or behind them:
//
//   Jl ql'' = F rb - cl ql' - dry(ql')                               qg = ql
//   Jg qg'' = F rb - T_O,  Jl ql'' = T_O - cl ql' - dry(ql')         T_O = Ko (qg - ql) + Co (qg' - ql')
//
// No declared value has to be right, only its spread. What the spreads below are where the rig file does not
// say them is a choice: what data sheets and drawings are good for.
//
// The exponent n is as declared; alpha or c may be absent. All teeth have some per cent of hysteresis h, and
// no rig file states it. By torque alone it is fitted always, as without it the play comes out too large;
// with an angle it is among what a rig file may lack. A mesh of angles has rb = 1: d in rad, F in N m.
//
// Symmetry of torque alone: with inertias, damping and stiffnesses times s, the contact's K times s^n and its
// alpha and c times s, and the backlash divided by s, the torque is the same. From torque alone the play is
// known no better than one of these scales, mostly the stiffness of the torque sensor. An angle ends that.
//
// Needs motor_torque that reverses and sensor_torque, at least two samples in a cycle of the motor against
// the pinion; uses motor_position. Each sample counts at the time at which it was taken (record/even_grid.h);
// one that is lost is a row that is not there. Of a square wave levels and moments of reversal are taken from
// motor_torque, of any other torque its samples, joined by straight lines. Where the period of a square wave
// is not steady, the moment of a reversal is a value of its window, between the two samples about it.
//
// Solved by fit/windowed_fit.h: values that all windows share, how each window starts, and windows that the
// machine does not follow lose weight. Where the plain machine leaves more than noise (1 % of the swing of
// the torque, 0.06 % of that of the position) it is fitted once more with what a rig file may lack, each with
// "nothing, give or take what such machines have": motor friction that falls with speed or grows with the
// load, quadratic drag, friction of the pinion, teeth of another exponent or with hysteresis, a curved
// sensor. What is left then is the same from sample to sample within half a cycle and from window to window,
// and counts that much more as noise.
//
// An answer passes five gates:
//
//   a sampled torque drives with 3 % of noise at most: beyond it answers were wrong and sure
//   half of the reversals are followed
//   5 % of the swing of a channel at most are left that are no noise
//   inertias and the sensor's stiffness are within four spreads of the declared ones
//   plays that fit alike (chi^2 of three standard errors) are within a factor of four
//
// Interval, 95 %, of all plays that fit alike, by the logarithm of the play: with position Student's t of the
// windows times the larger of two standard errors (of the fit with its priors; of windows as clusters),
// of torque alone 2.3 times the larger of these and of what the symmetry leaves; of a free link standard
// errors are 1.8 times as large, and 2.9 of them count with position: simulation. Beside it what is left of
// the position, and what is left of the torque as a twist of the sensor. Where the rig file lacks something,
// a torque of 7 % of the usual one, typical of such an effect, twists the sensor unseen. Nothing is finer
// than what equations of rigid flanks resolve (`finest`).
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {

/// How well the values of a machine are known: one standard deviation, of the logarithm where it says
/// "factor". What stands here is for values whose uncertainty the rig file does not say. Choices.
struct WaveformSpread {
  double sensor_stiffness = 0.09;  ///< factor: 18 % at 95 %
  double motor_inertia = 0.15, pinion_inertia = 0.15,
         gear_inertia = 0.15;                             ///< factor: 30 % at 95 %, by a drawing
  double motor_damping = 0.5;                             ///< factor: 2.7 at 95 %
  double sensor_damping = 1.3;                            ///< factor: 13 at 95 %, no data sheet has it
  double output_stiffness = 0.46, output_damping = 0.46;  ///< factor: 2.5 at 95 %
  double contact_stiffness = 0.46, contact_loss = 0.46,
         contact_damping = 0.46;                            ///< factor: 2.5 at 95 %
  double link_inertia = 0.15;                               ///< factor: 30 % at 95 %, by a drawing
  double link_damping = 0.5;                                ///< factor: 2.7 at 95 %
  double link_friction = kNaN;                              ///< N m; NaN: kDryFriction of the torque's level
  double dry_friction = kNaN;                               ///< N m; NaN: kDryFriction of the torque's level
  double friction_speed = 1.5;                              ///< factor
  double sensor_gain = 0.04;                                ///< factor
  double sensor_delay = 3e-4, sensor_time_constant = 1e-3;  ///< s: amplifiers of 150 Hz and more

  /// Of what is of a record more than of the machine.
  static constexpr double kDryFriction = 0.1;  ///< of the torque's level
  static constexpr double kBias = 0.1;         ///< of the torque's level, of the torque sensor
  static constexpr double kDrive = 0.04;       ///< of the torque's level: cogging, gravity
  static constexpr double kDriveSlope =
      1.6;  ///< of the level, per rad: cogging of it with 40 waves in a turn
};

/// What the gear drives.
enum class WaveformOutput {
  locked,       ///< spring and damper to the frame
  link,         ///< it is one body with a free link
  coupled_link  ///< spring and damper to a free link
};

/// The declared machine. All at the motor_position axis, as the rig file gives them. What it has not is NaN.
struct WaveformSettings {
  WaveformOutput output = WaveformOutput::locked;
  double base_radius = kNaN;                              ///< rb, m, > 0; of a mesh of angles 1
  bool angular = false;                                   ///< a mesh of angles
  double motor_inertia = kNaN;                            ///< Jm, kg m^2, > 0, with its share of the sensor
  double pinion_inertia = kNaN, gear_inertia = kNaN;      ///< Jp, Jg, kg m^2, > 0; no Jg: part of the link
  double motor_damping = kNaN;                            ///< cm, N m s/rad, > 0
  double dry_friction = 0;                                ///< N m, of the motor, >= 0
  double sensor_stiffness = kNaN, sensor_damping = kNaN;  ///< Ki, N m/rad, Ci, N m s/rad, > 0
  double output_stiffness = kNaN, output_damping = kNaN;  ///< Ko, N m/rad, Co, N m s/rad, > 0
  double contact_stiffness = kNaN;                        ///< K, N/m^n, > 0
  double contact_exponent = 1.5;                          ///< n, 1 to 1.5; is not fitted
  double contact_loss = kNaN;                             ///< alpha, s/m, > 0; NaN: none
  double contact_damping = kNaN;                          ///< c, N s/m, > 0; NaN: none
  double link_inertia = kNaN;                             ///< Jl, kg m^2, > 0, with its share of the output
  double link_damping = kNaN;                             ///< cl, N m s/rad, > 0; NaN: none
  double link_friction = kNaN;                            ///< N m, >= 0, dry friction of the link
  bool sensor_with_damper = false;                        ///< the sensor shows T and not Ki (qm - qp)
  double friction_speed = 0.02;                       ///< rad/s, > 0, at which dry friction changes its sign
  double sensor_gain = 1;                             ///< -, > 0, of the torque sensor
  double sensor_delay = 0, sensor_time_constant = 0;  ///< s, >= 0, of the torque sensor
  WaveformSpread spread;
  /// Besides the spreads: standard deviation of the logarithm of a factor that all values of the symmetry
  /// above have in common, of a machine commissioned from torque alone.
  double common_scale = 0;

  /// Half width of the narrowest interval, in the unit of the play. Flanks are no smoother (ground, Ra 0.3
  /// um), equations no finer; of a mesh of angles the same of a gear of 15 mm, as no radius is known.
  /// Choices.
  double finest() const {
    const double least = angular ? 4e-5 : 6e-7;
    return output == WaveformOutput::locked ? least : 1.5 * least;
  }
};

/// What a fit rests on, for people to see: what was measured about the reversals, what the fitted machine
/// does there, and its values.
struct WaveformEvidence {
  struct Trace {
    std::vector<double> measured, model;  ///< N m or rad; empty: not measured
  };
  struct Window {
    double start = 0;           ///< s, on the clock of the record, of its first sample
    std::vector<double> times;  ///< s after it, of each sample
    double misfit = 0;          ///< -, largest rms of a channel's residual in noises of the fit
    Trace torque, position;     ///< of the sensor, of the motor
  };
  struct Value {
    double declared = kNaN, spread = kNaN;  ///< before the record; the spread is as in WaveformQuantity
    double found = kNaN, standard_error = kNaN;
  };
  double interval = 0;                          ///< s, between samples
  double torque_noise = 0, position_noise = 0;  ///< standard deviations that the fit takes, N m, rad
  int left_out = 0;                             ///< windows that are not here, as the fit did not catch them
  std::vector<Window> windows;
  std::vector<Value> values;  ///< in the order of waveform_quantities(), NaN: none of this machine
};

/// Throws InvalidParameter for settings outside the ranges above. Answers by status:
///   insufficient_data  a channel is missing; too few reversals
///   out_of_domain      too coarse samples; a torque that is no square wave and noisy; the equations do not
///                      fit the record, or only with inertias or a stiffness far from the declared ones
///   ambiguous          two plays fit alike
///   below_range        the interval, which is given, holds 0
Estimate estimate_waveform(const record::Record& record, const WaveformSettings& settings);

/// A value of the machine that records identify.
struct WaveformQuantity {
  const char *name, *unit, *words;  ///< key in reports, unit, name in messages
  bool factor;                      ///< its spread is of the logarithm, else in its unit
  double power;                     ///< in the factor s of the symmetry, see scale_power()
  double WaveformSettings::*at;
  double WaveformSpread::*spread;
  const char* unit_of_angles = nullptr;  ///< of a mesh of angles, where it is another

  const char* unit_in(const WaveformSettings& settings) const {
    return settings.angular && unit_of_angles != nullptr ? unit_of_angles : unit;
  }
  /// Whether this machine has it.
  bool in(const WaveformSettings& settings) const { return settings.*at == settings.*at; }
};
const std::vector<WaveformQuantity>& waveform_quantities();
/// Its power in the factor of the symmetry: that of the contact's stiffness is the exponent.
double scale_power(const WaveformQuantity& quantity, const WaveformSettings& settings);

/// A machine as records of it identify it.
struct WaveformCommissioning {
  WaveformSettings machine;  ///< values, their spreads, the scale that they have in common
  struct State {
    double backlash = kNaN;                                      ///< m
    double log_error = kNaN;                                     ///< standard error of its logarithm
    bool position = false;                                       ///< else torque alone
    double residual[2] = {kNaN, kNaN}, noise[2] = {kNaN, kNaN};  ///< of the swing: torque, position
    int windows = 0, left_out = 0;
  };
  std::vector<State> states;              ///< one per record
  std::vector<std::string> undetermined;  ///< names of values that the records do not determine
};

/// Fits the machine to records of it in any states: all have the machine's values in common, each has its
/// backlash, its sensor's bias and its drive's offset. The first record is of the state whose backlash is
/// `known` (m; NaN: not known) with the standard deviation `known_error` of its logarithm.
///
/// The spreads are no sharper than the fit's covariance C of the logarithms, s^2 u u^T + R:
///   s^2 = 1 / (u^T C^-1 u), the most that can be of the direction u of the symmetry
///   the values' own: R's diagonal times the largest eigenvalue of R's correlation, so that it holds R
/// Throws CannotIdentify where a record does not fit, with its name and the reason.
WaveformCommissioning commission_waveform(const std::vector<record::Record>& records,
                                          const WaveformSettings& settings, double known = kNaN,
                                          double known_error = kNaN);

}  // namespace backlash::diagnosis
