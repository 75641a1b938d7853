// SPDX-License-Identifier: BSD-3-Clause
// Runs at constant speed: where they are in a record, their mean speed and torque.
#pragma once

#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

/// Mean speed [rad/s] and mean torque [N m] of one run. Without standard errors (NaN) the scatter of the rows
/// about the line decides.
struct ConstantSpeedRun {
  signal::Measured speed, torque;
  double from = 0, to = 0;  // s, in the record
};

struct ConstantSpeedOptions {
  double block = 0.25;   // s, over which oscillation is averaged: longer than its period
  double least = 2;      // s, of the shortest run
  double spread = 0.03;  // of the speed: how far the means of the blocks of one run may lie apart
};

/// The stretches of constant speed in a record with motor_torque and motor_velocity or motor_position, in
/// order of time, both signs. The first and last block of a stretch are dropped (end of the acceleration),
/// and further ones while the speed still settles: an inertia of 115 kg m^2 makes 1 N m of 0.01 rad/s^2.
/// Standard errors from batches of at least one block. Standing still is no run. Throws CannotIdentify where
/// there is none or a channel is missing, InvalidParameter for options <= 0.
std::vector<ConstantSpeedRun> find_constant_speed(const record::Record& record,
                                                  const ConstantSpeedOptions& options = {});

}  // namespace backlash::identification
