// SPDX-License-Identifier: BSD-3-Clause
// Crossings of the gap in a record of the motor's side. Equations: gap_traverse.h.
#pragma once

#include <cstddef>
#include <vector>

#include "backlash_diagnosis/diagnosis/gap_traverse.h"

namespace backlash::diagnosis {

/// Stretch of the record that begins in contact and holds one change of flank or more.
struct TraverseWindow {
  std::size_t first = 0;
  double side = 1;                     // flank at the first sample
  double torque = 0, torque_rate = 0;  // N m, N m/s through the teeth there
  double load = 0, load_rate = 0;      // with the load's encoder, instead: what it shows there, rad, rad/s
  double width = 0;                    // rad, of motor minus load position within it
  double load_torque = 0;              // N m, that the declared terms take of the load in its middle
};

constexpr int kTorqueWaves = 4;  // sine and cosine of two orders

/// The motor's side of a record.
struct TraverseData {
  double interval = 0;                      // s
  int steps = 1;                            // of the integration per sample
  std::size_t samples = 0;                  // of a window
  std::vector<double> torque;               // N m, of the motor
  std::vector<double> position, rate;       // rad, rad/s
  std::vector<double> acceleration;         // rad/s^2, second difference
  std::vector<char> counts;                 // whether dry friction is known: not about a standstill
  std::vector<double> waves[kTorqueWaves];  // of unit amplitude, over the motor's turn; empty: none was found
  double noise = 0, slope_noise = 0;        // N m, N m/s, of the averaged torque through the teeth
  double torque_noise = 0;                  // N m, of a sample of the torque, white
  double position_noise = 0;                // rad, the same of the position, at least that of its steps
  double clear = 0;                         // N m, of it, that presses a flank for sure
  double level = 0;                         // N m, of it, median where it presses a flank
  double slow = 0;                          // rad/s, below which dry friction fades
  // Of the load's encoder, if there is one: rad, about the motor's position; whether it was read
  std::vector<double> load;
  std::vector<char> load_counts;
  std::vector<double> sine, cosine;            // of the position, for an eccentric disk
  double load_noise = 0, load_rate_noise = 0;  // rad, rad/s, white
  double shown_spread = 0;                     // rad, of the encoders' errors from window to window
  double load_torque_spread = 0;               // N m, of what nothing explains from window to window
  double unsure_place = 0;  // rad, by which the joint moves while the time of a sample is not known
  double width = 0, window_width = 0;  // rad, of motor minus load position, and within most of the windows
  std::size_t crossings = 0;           // changes of flank, of which windows may hold several
  std::size_t within = 0;              // of them, from flank to flank in a window
  std::vector<TraverseWindow> windows;
};

/// What is known of the motor, by which a record is cut into windows.
struct TraverseMotor {
  double inertia = 0, damping = 0, friction = 0;  // kg m^2, N m s/rad, N m
  double unsure = 0;  // N m, by which the torque that it leaves for the teeth may be off
};

/// With the load's encoder: windows side by side over all of the record where the motor moves. Throws
/// Refusal.
TraverseData traverse_data_by_load(const record::Record& record, const GapTraverseSettings& settings);

/// Adds the waves of these orders [per rad of motor_position], at most two.
void add_waves(TraverseData& data, const std::vector<double>& orders);

/// With the motor's alone. Throws Refusal.
TraverseData traverse_data(const record::Record& record, const GapTraverseSettings& settings,
                           const TraverseMotor& motor);

}  // namespace backlash::diagnosis
