// Play from torque against motor position with the output locked (hysteresis curve of a gear unit).
//
// Lost motion: with the output locked, torque is led slowly (or switched) between the two signs; the angle
// between the positions at +T and -T is the play from wall to wall at T (hysteresis curve and lost motion as
// gear makers state it, e.g. at +-3 % of the rated torque: Sumitomo, "Fine Cyclo" catalogue, section
// "Stiffness and lost motion"; Harmonic Drive, engineering data, "Hysteresis loss, lost motion, torsional
// stiffness"). Conventions used here:
//
//   excursion       contiguous stretch in which side * torque exceeds a level: the stretch with the largest
//   sum of
//                   (side * torque - level) within one half cycle (Kadane), so that torque noise does not cut
//                   it
//   wall position   Hann-weighted mean over the last third of an excursion, that is on the unloading branch
//   for a ramp
//                   and at the end of the half period for a square wave; shortened to 0.1 T where torque
//                   changes
//   play            median over neighbouring walls of x(+) - x(-), common linear drift taken out before
//   settling        where torque is switched, the mean still approaches its limit while ringing dies out.
//   With the mean m
//                   and standard deviation S over the window (2) and over one half a window earlier (1), rho
//                   = S2/S1: x = m2 + (m2 - m1) rho/(1 - rho), geometric extrapolation, rho <= 0.7
//   interval        95 %, root of the squares of: Student t (n - 3 degrees of freedom, n walls) times 1.25 s
//   sqrt(2/n);
//                   ringing (where torque is switched once its rms at one wall, else four times); the
//                   settling extrapolation in full; one step of the position's resolution; the elastic
//                   deflection's uncertainty; the deflection that friction on the flanks may carry, where
//                   deflection is subtracted from a ramp (shares of ringing and settling: bounds of the error
//                   in simulations of a ringing rig, 0 to 150 um half gap, square waves of 7 to 20 Hz, sine
//                   and triangle of 1 to 10 Hz)
//
// Positive torque must move towards positive position. Motion must be slow or come to rest before torque
// returns. Torque: motor_torque where present, else sensor_torque (equal where the motion is quasi-static).
#pragma once

#include <functional>

#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash {

struct LostMotionSettings {
  /// N m, > 0: torque at which play is stated. With subtract_elastic_deflection NaN is allowed and means 0.9
  /// times the torque that the record reaches on both sides.
  double torque = kNaN;

  /// False: backlash_angle is the play from wall to wall at +-torque, elastic deflection included.
  /// True: elastic_deflection is subtracted on both sides; what remains is the free play between the flanks.
  bool subtract_elastic_deflection = false;

  /// rad, >= 0: elastic deflection of one side at a torque > 0 [N m]. Needed for subtract_elastic_deflection;
  /// otherwise used (where not empty) only if torque is switched to a level more than 10 % above `torque`.
  std::function<double(double torque)> elastic_deflection;

  /// Relative 95 % uncertainty of elastic_deflection, >= 0.
  double elastic_uncertainty = 0.02;

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
///                      travel negative or smaller than the elastic deflection by more than the interval
/// `components` (angles at the axis of motor_position) come from the hysteresis loop, see hysteresis_loop.h;
/// where torque is switched, gap is the play without elastic_deflection, compliance and coulomb are NaN and
/// message says why.
Estimate estimate_lost_motion(const Record& record, const LostMotionSettings& settings);

}  // namespace backlash
