// SPDX-License-Identifier: BSD-3-Clause
// A record of a servo as the identification wants it: evenly sampled, at the load side, with rates.
#pragma once

#include <vector>

#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash {

/// All at the load side of the reduction; columns of equal length, empty where the record has no such
/// channel.
struct ServoData {
  double interval = 0;                         // s
  std::vector<double> torque;                  // N m, of the motor
  std::vector<double> motor, motor_rate;       // rad, rad/s (five-point difference)
  std::vector<double> motor_acceleration;      // rad/s^2 (second difference)
  double rate_noise = 0;                       // rad/s, standard deviation of the noise of motor_rate
  std::vector<double> load, load_rate;         // rad, rad/s (low-passed, see load_rate_cutoff)
  double first_load = 0, first_load_rate = 0;  // rad, rad/s, from a line through the first samples
  std::size_t size() const { return motor.size(); }
};

/// The record with all channels at the load side of the reduction.
Record load_side(const Record& record, const Rig& rig);

/// Hz; what is missing of the speed that feeds back to the simulated load counts like a friction of it.
constexpr double kLoadRateCutoff = 120;
double load_rate_cutoff(double interval);  ///< [Hz]; the same or less where the interval [s] needs it

/// A machine with one inertia or a locked link may move so slowly that its speed drowns in the resolution of
/// the encoder, and the direction of friction with it. Where the noise of the rate is more than a fiftieth of
/// its root mean square the motor position is low-passed, in the widest band in which it is not. With two
/// inertias the position stays as it is: there it drives a load.
///
/// Needs motor_torque and motor_position; load_position where the record has it. Throws CannotIdentify
/// without them, BadData for gaps or values that are not finite (naming channel and time).
ServoData servo_data(const Record& record, const Rig& rig);

}  // namespace backlash
