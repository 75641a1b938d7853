// SPDX-License-Identifier: BSD-3-Clause
// By how much the encoder of the load is later than that of the motor, from a record of both.
//
//   q_M - q_L = o + s q_L + d w_L + g T + h tanh(T / T_0) + c sign(w_L) + e a_M,    T = tau - J a_M
//
// d is the skew [s], > 0: load_position(t) shows q_L(t - d). o and s are offset and scale of the encoders,
// g and e the compliance under the motor's torque less its inertia's, h half of a play whose flank that
// torque chooses, c what friction does to either. Least absolute deviations: what is seldom, as a flight
// through the gap, does not count. All columns are low-passed to the bandwidth of the motion.
#pragma once

#include <vector>

#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::record {

/// Columns of equal length, evenly sampled and finite, on one axis.
struct DrivenPositions {
  double interval = 0;                              // s
  const std::vector<double>&torque, &motor, &load;  // N m, rad, rad
  double motor_inertia = 0;                         // kg m^2, J; a rough value does
};

/// The skew [s]; standard error from blocks left out, from half the bandwidth, and what such a model leaves
/// wrong (0.05 ms, simulation). Throws CannotIdentify where the record is too short or its columns cannot be
/// distinguished.
signal::Measured encoder_skew(const DrivenPositions& positions);

/// Whether a skew differs clearly from zero: four standard errors.
bool is_clear(const signal::Measured& skew);

/// The load's position and speed at the time of the motor's: moved by `skew` [s], cubic between samples of a
/// record that is evenly sampled.
Record without_encoder_skew(Record record, double skew);

}  // namespace backlash::record
