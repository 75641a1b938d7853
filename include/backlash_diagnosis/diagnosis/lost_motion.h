// SPDX-License-Identifier: BSD-3-Clause
// Play from torque against motor position with the output locked: the hysteresis curve of a gear unit.
//
// Lost motion is the angle between the positions at +T and -T when torque is led slowly (or switched)
// between the two signs, as gear makers state it (e.g. at +-3 % of the rated torque: catalogues of Sumitomo
// Fine Cyclo, "lost motion", and Harmonic Drive, "hysteresis loss"). Here, with u torque and x position:
//
// Excursion: the stretch of one half cycle with the largest sum of (side * u - level), which torque noise
// does not cut. The level is 0.95 T, or T/2 where elastic deflection is subtracted (any torque will do then).
//
// Wall position: Hann-weighted mean over the last third of an excursion: the unloading branch of a ramp, the
// end of the half period of a square wave. At level 0.95 T, torque may change by 0.1 T within the window.
//
// Play: median over neighbouring walls of x(+) - x(-), after a common linear drift is taken out.
//
// Ramps on to 1.5 T and more: dry friction hinders the way to the peak and holds what it winds up on the way
// back, so the walls at T are c (T - Fc) and c (T + Fc) deep. Play is then the middle of both ways (as gear
// makers read a loop up to the rated torque), and the interval holds both.
//
// Settling: where torque is switched, the mean m still approaches its limit while ringing dies out. With mean
// and standard deviation S over the window (2) and half a window earlier (1), rho = S2/S1 <= 0.7:
//   x = m2 + (m2 - m1) rho / (1 - rho).
// Where torque is held half as long again at times, ringing is at different stages: m2 is taken, and the
// whole extrapolation is in the interval.
//
// Interval, 95 %, root of the sum of squares of
// - scatter: Student t (n - 3 degrees of freedom, n walls) times 1.25 s sqrt(2/n),
// - ringing: a quarter of its rms at one wall where torque is switched, four times that where it is ramped,
// - settling: 0.3 times the extrapolation,
// - resolution: one step of the position,
// - elastic deflection, where subtracted: its uncertainty, and what the flanks yield more or less under the
//   torque that sensor_torque says beside motor_torque (dry friction, a drive that gives other than it says),
//   for ramps at least what friction on the flanks carries.
// The shares of ringing and settling hold 95 % of the errors in simulations of a ringing rig (half gap 0 to
// 150 um, square wave 7 to 15 Hz, sine and triangle 1 to 10 Hz).
//
// Positive torque must move towards positive position, and the motor must come to rest before torque returns.
// Torque is motor_torque where present, else sensor_torque (equal where the motion is quasi-static).
#pragma once

#include <functional>

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::diagnosis {

struct LostMotionSettings {
  /// N m, > 0: torque at which play is stated. With subtract_elastic_deflection NaN is allowed and means 0.9
  /// times the torque that is exceeded on each side for an eighth of the record.
  double torque = kNaN;

  /// False: backlash_angle is the play from wall to wall at +-torque, elastic deflection included.
  /// True: elastic_deflection is subtracted on both sides; what remains is the free play between the flanks.
  bool subtract_elastic_deflection = false;

  /// rad, >= 0: elastic deflection of one side at a torque > 0 [N m]. Needed for subtract_elastic_deflection;
  /// otherwise used (where not empty) only if torque is switched to a level more than 10 % above `torque`.
  std::function<double(double torque)> elastic_deflection;

  /// Relative 95 % uncertainty of elastic_deflection, >= 0.
  double elastic_uncertainty = 0;

  /// m, > 0; NaN where the rig gives none, then Estimate::backlash is NaN.
  double base_radius = kNaN;

  /// rad, > 0: most that load_position, where recorded, may move; NaN: 5 % of the travel of motor_position.
  double locked_tolerance = kNaN;
};

/// Estimates play by the definitions above, in time linear in the samples. Throws InvalidParameter for
/// settings outside the ranges above. Everything that lies in the record is answered by the status:
///   insufficient_data  no motor_position, no torque, or fewer than two excursions on a side
///   out_of_domain      torque does not reach the level on both sides; torque jumps past the level and no
///                      elastic_deflection is given; output moves; motor does not come to rest at the walls;
///                      travel negative or smaller than the elastic deflection by more than the interval;
///                      only sensor_torque is recorded and it rings where the walls are read; the play steps
///                      or grows within the record
/// `components` (angles at the axis of motor_position) come from the hysteresis loop, see hysteresis_loop.h;
/// where torque is switched, gap is the play without elastic_deflection, compliance and coulomb are NaN and
/// message says why.
Estimate estimate_lost_motion(const record::Record& record, const LostMotionSettings& settings);

}  // namespace backlash::diagnosis
