// SPDX-License-Identifier: BSD-3-Clause
// What a fit makes of the delay of the torque: held between samples or of the moment, calibration or effect.
#pragma once

#include "joint_fit.h"

namespace backlash::identification {

/// A torque that seems to act over a quarter of a sample earlier than a held one is that of the moment.
void release_hold(Machine& machine);
/// The reverse: a torque of the moment that seems to act more than a quarter of a sample later is held. Asked
/// once an effect has been added that the delay may have stood in for.
void restore_hold(Machine& machine);

/// Where a delay is longer than `longest` [samples] that much stays and is fitted no more, so that the rest
/// shows as an effect.
void limit_delay(Machine& machine, double longest);

/// rad: the encoders' offset at which the load is, in the median, where the motor is. Each record has its
/// own, for an encoder that counts finds its zero anew whenever the robot is switched on.
double middle_offset(const ServoData& record);

/// No delay by calibration, where a term of the model is the delay.
void without_calibration(Machine& machine);

/// Moves the mean delay of the calibrations into the last term, a delay.
/// `interval` [s] between samples.
void move_delay_to_term(Machine& machine, double interval);

}  // namespace backlash::identification
