// SPDX-License-Identifier: BSD-3-Clause
// The torque of a square wave from the motion of the motor alone, see momentum_transfer.h.
#pragma once

#include "momentum_flank.h"

namespace backlash::diagnosis::momentum {

/// Replaces `motor.torque`. Throws Refusal for a motion that is not that under a square wave, and where no
/// level stands out of the noise.
void estimate_torque(Motor& motor, const MomentumTransferSettings& s);

/// Refuses an estimate that contradicts the places where the motor rests.
void check_rest(const Motor& motor, const MomentumTransferSettings& s, Estimate& estimate);

}  // namespace backlash::diagnosis::momentum
