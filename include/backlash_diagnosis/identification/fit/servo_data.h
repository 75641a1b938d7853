// SPDX-License-Identifier: BSD-3-Clause
// A record of a servo as the identification wants it: evenly sampled, at the load side, with rates.
#pragma once

#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::identification {

/// All at the load side of the reduction; columns of equal length, empty where the record has no such
/// channel.
struct ServoData {
  double interval = 0;                      // s
  double start = 0;                         // s, from the beginning of the recording
  std::vector<double> torque;               // N m, of the motor
  std::vector<double> motor, motor_rate;    // rad, rad/s (five-point difference)
  std::vector<double> recorded_motor;       // rad, before it was smoothed; empty where it was not
  std::vector<double> motor_acceleration;   // rad/s^2 (second difference)
  std::vector<double> smooth_acceleration;  // rad/s^2, of a machine with one inertia: see servo_data()
  long rate_reach = 2;                      // samples to either side that motor_rate is taken from
  long smooth_reach = 0;                // samples, by which motor_rate is less sharp where it was smoothed
  bool teeth_recorded = false;          // teeth press where recorded_motor is; see press_as_recorded()
  double rate_noise = 0;                // rad/s, standard deviation of the noise of motor_rate
  std::vector<double> load, load_rate;  // rad, rad/s (low-passed)
  double load_rate_cutoff = 0;          // Hz, of that low-pass
  double first_load = 0, first_load_rate = 0;  // rad, rad/s, from a line through the first samples
  std::vector<bool> lost;  // of each sample: it was not recorded, and lies between its neighbours
  std::size_t size() const { return motor.size(); }
};

/// The record with all channels at the load side of the reduction.
record::Record load_side(const record::Record& record, const model::Rig& rig);

/// s: duration of a record over one more than how often the motor turns round, beyond the noise of its speed.
double time_between_reversals(const ServoData& data);

/// A machine with one inertia or a locked link may move so slowly that the resolution of the encoder hides
/// its speed, and with it the direction of friction. Where the noise of the rate is more than a fiftieth of
/// its root mean square the motor position is low-passed, in the widest band in which it is not. With two
/// inertias the position stays as it is: there it drives a load.
///
/// Friction of one inertia may follow what its load takes, which follows from the acceleration
/// (gear_train.h). That of the second difference is mostly noise: low-passed in the widest band in which a
/// fiftieth of it is.
///
/// The recorded speed of the load draws a simulated one (driven_load.h); what its low-pass takes away counts
/// there like a friction. So its cutoff is 2.7 times the mesh resonance (mesh_resonance.h), or 0.2 of the
/// sampling rate if that is less. `usual_torque` [N m] sets that resonance where it depends on the torque; 0:
/// the record's own.
///
/// Needs motor_torque and motor_position; load_position where the record has it. Throws CannotIdentify
/// without them, BadData for gaps or values that are not finite (naming channel and time).
ServoData servo_data(const record::Record& record, const model::Rig& rig, double usual_torque = 0);
/// Of one that is evenly sampled, with the rows that were lost.
ServoData servo_data(const record::EvenGrid& record, const model::Rig& rig, double usual_torque = 0);

/// Teeth that press, and the acceleration, as they were recorded: a low-pass would round them off. Where the
/// smoothed rate is not sharp it then has no direction.
void press_as_recorded(ServoData& data);

/// Other columns of a machine whose load moves freely, with bands and noise as in `pattern`.
ServoData with_columns(const ServoData& pattern, std::vector<double> torque, std::vector<double> motor,
                       std::vector<double> load);

}  // namespace backlash::identification
