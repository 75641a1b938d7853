// SPDX-License-Identifier: BSD-3-Clause
// Play from two encoders: what motor_position and load_position differ by while torque presses one flank and
// the other, less the elastic deflection. Model and fit: see flank_fit.h. The load may be locked or move.
//
// Which flank is pressed, and by how much, the load says itself where it moves: its encoder shows its
// acceleration, its inertia is declared, and so are its friction and weight (flank_torque.h). The friction of
// the motor has no part in it. A weight that is not declared is taken from the motor's torque, where that
// shows one clearly. Of a locked output the torque is what the motor leaves, of a record with output_torque
// alone that.
//
// Common to both flanks, and therefore without effect on the play: zero, scale and eccentricity of the
// encoders, errors that follow the position, a load encoder that is late, damping of the teeth.
//
// The law of the teeth is an unknown: powers of the deflection from 1 to 1.5, and springs that harden. The
// interval holds the play by every law that leaves up to 1.5 times the squares of the best one, 1.1 times
// where that is a spring, and what three standard errors do not distinguish; between two laws that are tried
// the squares follow a parabola. Windows count down to the torque at which the deflection is lost in the
// residuals, so that the laws differ little where that is possible. How much the teeth yield the record
// shows; of a locked output, which knows one torque only, it is declared.
//
// Interval, 95 %, root of the sum of squares of: scatter over stays on a flank (Student t) by all those laws,
// the change with the length of the windows, 0.3 times the residual, and 1 % of the play and 0.5 % of the
// deflection for what the model does not hold (simulation). Of a locked output also the declared deflection,
// twice the residual, as a pinion that keeps bouncing shifts all windows alike, and 3 % of the play for the
// bouncing that the residual does not show.
//
// An answer passes five gates:
//
// clang-format off
//
//   | gate               | passed where                                                                     |
//   |--------------------|----------------------------------------------------------------------------------|
//   | it was recorded    | both positions, a torque, 64 samples                                             |
//   | flanks are pressed | each in twelve windows, in six stays                                             |
//   | they stay pressed  | in half of those windows, and no torque that alternates from sample to sample    |
//   |                    | throws the motor by a tenth of its rms speed                                     |
//   | it is this machine | the teeth yield by a fifth to five times the declared deflection; friction and   |
//   |                    | weight of the load are within 2.5 standard deviations; the encoders agree to 1 % |
//   |                    | in scale; a locked output rests; no negative play; no impossible jumps           |
//   | it is one play     | the same in all parts, and known to twice itself or a quarter of the deflection  |
//
// clang-format on
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

  /// kg m^2, >= 0: what motor_torque accelerates before it reaches the flank, at the motor_position axis.
  /// Certain to +-50 % (one standard deviation).
  double motor_inertia = 0;

  /// At the motor_position axis, >= 0: kg m^2, N m s/rad and N m (dry) of the load. The inertia is needed
  /// where the load moves; the friction over it is certain to +-60 %.
  double load_inertia = 0, load_damping = 0, load_friction = 0;

  /// N m that declared terms (gravity) take of the load at this motor_position [rad], over its inertia
  /// certain to +-30 %; empty: none is declared.
  std::function<double(double)> load_torque;

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

/// Estimates play as above. Throws InvalidParameter for settings outside the ranges above. Everything that
/// lies in the record is answered by the status: insufficient_data by the first gate and for too few
/// stays, else out_of_domain. Torque is motor_torque where present, else sensor_torque, else output_torque.
Estimate estimate_position_difference(const record::Record& record,
                                      const PositionDifferenceSettings& settings);

}  // namespace backlash::diagnosis
