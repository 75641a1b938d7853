// SPDX-License-Identifier: BSD-3-Clause
// Two parallel flanks in the plane of deflection and torque, fitted to a record with two encoders.
//
//   phi = f(q_L) + side * b / 2 + g e(T) + c (w_M - w_L),    T = tau - J a_M - d w_M - C sign(w_M)
//
// phi = q_M - q_L is the difference of the encoders [rad], e the declared elastic deflection [rad] of one
// side under a torque [N m], positive torque pressing the positive flank. f is what both flanks have in
// common: offset and scale of the encoders, eccentricity, transmission error, and torques that depend on
// position (gravity, cogging) over the stiffness. b is the free play.
//
// All of it is averaged over short windows, see flank_windows.h.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "backlash_diagnosis/diagnosis/flank_windows.h"

namespace backlash::diagnosis {

struct FlankModel {
  std::function<double(double)> elastic;
  double inertia = 0;            // kg m^2, J to start from
  double elastic_deviation = 0;  // standard deviation of g about 1 where the record does not hold g
  bool moving = false;           // the load travels: f and b may depend on its position, friction has a sign
};

/// What keeps a record from showing two flanks; the later, the closer it comes.
enum class FlankObstacle {
  not_pressed,    ///< a flank is pressed in less than 10 % of the windows
  one_direction,  ///< each is pressed in one direction of motion only: dry friction of the motor looks alike
  chatter,        ///< flanks change within the windows
  own_part,       ///< position, speed, acceleration and torque determine which is pressed
  none
};

struct FlankFit {
  FlankObstacle obstacle = FlankObstacle::not_pressed;  ///< `none` where `found`
  /// Both flanks are pressed (10 % of the windows on each), in either direction of motion, and which is no
  /// function of position, speed, acceleration and torque (of the squares of `side` these leave 0.3 % and
  /// more).
  bool found = false;
  double gap = 0, standard_error = 0;     // rad
  double least_gap = 0, largest_gap = 0;  // rad, over the travel, where `varies`
  bool varies = false;                    // the gap depends on the position of the load
  bool compliance_from_record = false;    // else declared
  double compliance_factor = 1;           // g
  double scale_error = 0;                 // slope of f over q_L
  /// rad, what the gap gains if all of the residual is noise of the torque, which draws the compliance
  /// towards 0 (Fuller 1987, Section 1.1); infinite where then no compliance is left.
  double attenuation = 0;
  double residual = 0;           // rad, rms
  std::size_t used[2] = {0, 0};  // windows on the negative and the positive flank
  std::size_t stays = 0;         // uninterrupted stays on a flank
  /// Of them, how often the motor moves away from the flank that is pressed, as where it brakes or the load
  /// drives. Without, side and sign(w_M) are one, and so are b / 2 and the deflection that C causes: 0
  /// where less than 4 % of the windows are of such. Of a locked output, which shows no friction, all.
  std::size_t against = 0;
  /// rad, every window: how far it lies from where the fit has the flanks, or from a free flight between them
  /// without torque. NaN where friction has no certain sign.
  std::vector<double> away;
};

/// Windows count in which the flank is loaded for certain: deflection and predicted elastic deflection both
/// beyond three residuals on the same side. Found by iteration from the outermost deflections. The standard
/// error holds for residuals that are correlated within a stay on a flank (sandwich estimator over stays;
/// White 1980, Liang and Zeger 1986).
FlankFit fit_flanks(const FlankWindows& windows, const FlankModel& model);

}  // namespace backlash::diagnosis
