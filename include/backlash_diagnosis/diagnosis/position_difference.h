// SPDX-License-Identifier: BSD-3-Clause
// Play from two encoders: what motor_position and load_position differ by when torque presses one flank and
// the other, less the elastic deflection. Model and fit: see flank_fit.h. The load may be locked or move.
//
// Common to both flanks, and therefore without effect on the play: offset of the encoders, a scale error up
// to 1 %, eccentricity, transmission error, gravity, cogging; where the load moves each may follow its
// position.
//
// Skew: a load encoder that is d [s] late adds d w_L to the difference. Where the load moves, d is estimated
// from the record (record/encoder_skew.h); where it is four standard errors away from the declared one and
// the flanks are known more surely without it, it is taken out. A smaller one acts like a friction of the
// motor, which the fit holds.
//
// Elastic deflection: where the load moves, the record itself shows how deflection follows torque; where it
// is locked, or the record does not hold it to 10 %, the declared function counts.
//
// Where each flank is pressed in one direction of motion only, as those of a light load that is dragged, a
// play looks as more dry friction of the motor does: windows in which the motor moves away from the pressed
// flank distinguish them, and a reading with fewer than three stays of such, or 4 % of its windows, is none.
// Nor is one with less than a tenth of its windows on one of the flanks, nor one in which position, speed,
// acceleration and torque determine which flank is pressed (moves to and fro over the same path): there play
// is what the encoders may be off by. Nor one whose flanks change within its windows, as under a drive that
// chatters: such averages show no play (describing function of a dead zone under dither).
//
// A load that moves shows the torque on the flanks as well: what the motion of both takes, fitted to the
// recorded torque (with_balanced_torque), is free of its noise, which as a regressor would draw compliance
// and play towards others (Fuller 1987). The record is read by either torque and over windows of 7 to 63
// samples; that reading counts which is surest. Read also with a deflection that follows the torque by other
// laws (powers from 0.55 to a spring's 1, Hertz's 2/3 among them, springs that harden). Laws are compared by
// what they leave of all windows, those in flight too, where no torque may be left: mean squares over those
// of the best law, geometric mean over the cuts that distinguish laws. Where the declared one is clearly
// worse than another, the better counts, and the interval holds the play by all that leave up to 1.5 times
// what the best does (2.5 where that gives the play to a tenth only, be it the declared one; 3 where the
// recorded torque is too noisy). Where the declared one counts it holds those that stays on the flanks do not
// distinguish from it.
//
// Interval, 95 %, root of the sum of squares of
// - scatter: Student t times the standard error, stays on a flank counted as independent,
// - the declared elastic deflection, where used: its uncertainty; with a locked output also that of the whole
//   declared machine,
// - windows: the difference to the same fit with windows of another length,
// - what the model does not hold: twice the rms residual with a locked output, where all windows lie at
//   nearly one torque and a pinion that keeps bouncing shifts all of them alike; 0.3 times it where the load
//   moves,
// - the skew of the encoders, where it was taken out: the change of the play over its interval,
// - with a locked output 3 % of the play, for the bouncing that the residual does not show; where the load
//   moves 1 %, and 3 % where the deflection bends otherwise than declared, besides 0.5 % of the deflection
//   under a large torque for friction that is not as modelled, or 5 % where it bends otherwise;
// and on one side what the play would change if all of the residual were noise of the torque.
// The shares are set by simulation, see test_rig_estimators.cpp, and for loads that move by the machines of
// scripts/trace_machines.sh (doc/reference/estimators.md).
//
// A record that holds one torque and then another, with too few moves for all this, is read at rest: the
// distance of motor minus load between the two (rest_levels.h), with what the teeth yield by, which
// `deflection` bounds and `components` take off.
//
// Where the play depends on the position of the load, the interval is widened to the least and the largest
// play over the travel; backlash_angle is then the mean over the windows.
#pragma once

#include <functional>

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {

struct PositionDifferenceSettings {
  /// rad at the motor_position axis, odd: elastic deflection of one side under a torque [N m]. Needed; where
  /// the load moves a value within a factor of three is enough.
  std::function<double(double torque)> elastic_deflection;

  /// Relative 95 % uncertainty of elastic_deflection, > 0.
  double elastic_uncertainty = 0.02;

  /// Relative 95 % uncertainty of elastic_deflection, >= 0, by which the whole machine may differ from the
  /// declared one. Where the load is locked the interval is wider by twice this share of the deflection under
  /// the median torque; the fit does not use it, as a record of nearly one torque cannot distinguish it from
  /// play.
  double declared_uncertainty = 0;

  /// kg m^2, >= 0: what motor_torque accelerates before it reaches the flank, at the motor_position axis. A
  /// value to start from, taken as certain to +-50 % (one standard deviation).
  double motor_inertia = 0;

  /// Angle at the motor_position axis per angle of load_position, > 0: Rig::motor_axis_ratio().
  double load_ratio = 1;

  /// The rig says so; then a load_position that moves by more than 5 % of motor_position is refused.
  bool output_locked = false;

  /// output_torque has the other sign than the rig's load: sensors: output_torque: {reversed: true}.
  bool output_torque_reversed = false;

  /// s, by which load_position is later than motor_position, as declared: taken out first.
  double encoder_skew = 0;

  /// m, > 0; NaN where the rig gives none, then Estimate::backlash is NaN.
  double base_radius = kNaN;
};

/// Estimates play as above, in time linear in the samples. Throws InvalidParameter for settings outside the
/// ranges above. Everything that lies in the record is answered by the status:
///   insufficient_data  no motor_position, no load_position, no torque, too few samples or changes of flank
///   out_of_domain      the output moves although it is locked; torque does not press both flanks, or each
///                      in one direction of motion or in one part of the path only; the torque alternates
///                      from sample to sample and throws the motor by a tenth of its rms speed; the
///                      deflection does not follow it; the interval would be as wide as the deflection, or
///                      more than a quarter of that and twice the play; the encoders differ by more than 1 %
///                      in scale; the play is negative beyond the interval, another in other parts of the
///                      record, or another with windows of another length or by another torque
/// Torque is motor_torque where present, else sensor_torque, else output_torque, which the motor's inertia
/// and friction do not reach: the friction in the fit is then that between the teeth and the sensor.
Estimate estimate_position_difference(const record::Record& record,
                                      const PositionDifferenceSettings& settings);

}  // namespace backlash::diagnosis
