// SPDX-License-Identifier: BSD-3-Clause
// The delay of the torque in a fit: whether the torque is held between samples or sampled at the moment, and
// whether a delay is calibration or an effect.
#pragma once

#include <vector>

#include "joint_fit.h"

namespace backlash::identification {

/// A torque that acts more than a quarter of a sample earlier than a held one would is a torque of the
/// moment.
void release_hold(Machine& machine);
/// The reverse: a torque of the moment that seems to act more than a quarter of a sample later is held. Asked
/// once an effect has been added that the delay may have stood in for.
void restore_hold(Machine& machine);

/// A delay longer than `longest` [samples] is limited to it and no longer fitted, so that the rest shows as
/// an effect.
void limit_delay(Machine& machine, double longest);

/// rad: the offset of the encoders with which the median of motor minus load is 0. Each record has its own,
/// as an incremental encoder finds a new zero whenever the robot is switched on.
double middle_offset(const ServoData& record);

/// With a locked link the middle of the gap and of both wind-ups is in the middle of the travel, and both
/// flanks must have touched.
void start_in_travel(Machine& machine, const std::vector<ServoData>& data);

/// Sets the delays of the calibration to 0 if a term of the model is the delay.
void without_calibration(Machine& machine);

/// Moves the mean delay of the calibrations into the last term, a delay.
/// `interval` [s] between samples.
void move_delay_to_term(Machine& machine, double interval);

}  // namespace backlash::identification
