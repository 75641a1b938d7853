// SPDX-License-Identifier: BSD-3-Clause
// Scale and offset between the sensors of motor and load, from runs one way. Yumrukcal (2013), Section 3.2:
// the load sensor is the standard; the flank that drives stays in contact, so both sides turn together.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct CalibrationOptions {
  double block = 0.1;   // s, over which ringing and noise are averaged
  double settle = 0.3;  // s, left out where a direction begins or ends (play is crossed, ringing decays)
};

/// load = scale * motor + offset [rad/s].
struct SpeedCalibration {
  signal::Measured scale, offset;
  std::vector<std::string> warnings;
};

/// From motor_velocity and load_velocity; a reversal cuts the record, both directions may contribute. Throws
/// CannotIdentify where a channel is missing, nothing moves one way for eight blocks, or the speeds differ by
/// less than a tenth of the largest (scale and offset are then one).
SpeedCalibration calibrate_speed(const record::Record& record, const CalibrationOptions& options = {});

/// load = scale * motor + offset [rad]: offset is the mean of both directions, in which torque wind-up and
/// play have opposite signs; their difference, the load behind the motor, is reported: gap + 2 T_load / k.
struct PositionCalibration {
  signal::Measured scale, offset;
  signal::Measured play_and_wind_up;  // rad, total; NaN with one direction only
  double travel = 0;                  // rad of the motor, used
  std::vector<std::string> warnings;
};

/// From motor_position and load_position of runs one way, in one record or several of the same zero (sensors
/// not switched off between). Standard errors by leaving out tenths of each run, so an error of position that
/// repeats over less than that is in them; quantisation too. Throws CannotIdentify where a channel is missing
/// or nothing moves one way for ten blocks. Warns with one direction only: offset then holds play and
/// wind-up.
PositionCalibration calibrate_position(const std::vector<record::Record>& records,
                                       const CalibrationOptions& options = {});

}  // namespace backlash::identification
