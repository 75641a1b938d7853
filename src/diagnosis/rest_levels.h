// SPDX-License-Identifier: BSD-3-Clause
// Two encoders at rest on either flank: a record that holds a torque, lets go and holds another, with too few
// moves for a fit. What motor and load differ by where a torque presses one flank, less what they differ by
// where it presses the other or none, is the play and what the teeth yield by. Where none presses, the motor
// has come to rest beyond its gap by the way it came; had it stopped short of the other flank the play would
// be larger, which several such rests at one place speak against.
#pragma once

#include <optional>

#include "backlash_diagnosis/diagnosis/flank_fit.h"
#include "backlash_diagnosis/diagnosis/position_difference.h"

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

/// The distance under torque, of which the teeth yield a part (`deflection`, `components`). False where
/// nothing stands still, or where the teeth alone may yield as much.
bool read_at_rest(const TwoEncoders& motion, const PositionDifferenceSettings& settings, Estimate& estimate);

}  // namespace backlash::diagnosis
