// SPDX-License-Identifier: BSD-3-Clause
// Two encoders at rest on either flank: a record that holds a torque, lets go and holds another, with too few
// moves for a fit. Motor minus load while a torque presses one flank, less the same while it presses the
// other flank or none, is the play plus the deflection of the teeth. If no torque presses the second flank,
// it is assumed that the motor has crossed its gap before it stopped. Had it stopped short of the flank, the
// play would be larger; several rests at one place make that unlikely.
#pragma once

#include <optional>

#include "backlash_diagnosis/diagnosis/position_difference.h"
#include "flank_windows.h"

namespace backlash::diagnosis {

struct RestLevel {
  double deflection = 0, spread = 0;  // rad, median of motor minus load, half its middle 90 %
  double torque = 0;                  // N m, median
  std::size_t windows = 0;
};

/// On the side to which the torque presses the motor, and on the other.
struct RestLevels {
  RestLevel pressed, other;
  double side = 1;  // sign of the torque of `pressed`
  double apart() const { return side * (pressed.deflection - other.deflection); }
};

/// None where the encoders move most of the time, where no torque is twice another, or where the levels
/// scatter by a fifth of their distance.
std::optional<RestLevels> rest_levels(const TwoEncoders& motion);

/// The distance of the flanks under torque; `deflection` and `components` have the part that is deflection of
/// the teeth. False if nothing stands still, or if the deflection of the teeth alone may be as large.
bool read_at_rest(const TwoEncoders& motion, const PositionDifferenceSettings& settings, Estimate& estimate);

}  // namespace backlash::diagnosis
