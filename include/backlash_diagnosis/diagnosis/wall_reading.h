// SPDX-License-Identifier: BSD-3-Clause
// Where the motor comes to lie at the two walls of the play, excursion by excursion of the torque.
#pragma once

#include <cstddef>
#include <vector>

#include "backlash_diagnosis/base/not_a_number.h"

namespace backlash::diagnosis {

/// Torque [N m] and motor position [rad] over time [s], same length, finite values only.
struct LockedMotion {
  std::vector<double> time, torque, position;
  std::vector<double> sensor;  ///< N m, by the torque sensor beside `torque`; may be empty
};

/// Samples [begin, end) in which side * torque exceeds a level.
struct TorqueExcursion {
  int side = 1;  ///< +1 or -1
  std::size_t begin = 0, end = 0;
};

/// Excursions above `level` [N m, > 0], one per half cycle (half cycles end where torque passes -level/2 of
/// the other side), without those that noise alone can make and without the last one if torque has not come
/// back by then.
std::vector<TorqueExcursion> find_excursions(const std::vector<double>& torque, double level);

/// What one excursion shows of its wall. Positions in rad, not multiplied by side.
struct WallReading {
  int side = 1;
  double time = 0;           ///< s, middle of the window
  double held = 0;           ///< s, length of the excursion
  double torque = 0;         ///< N m, Hann-weighted mean of side * torque over the window
  double sensor = kNaN;      ///< N m, the same of LockedMotion::sensor; NaN where that is empty
  double torque_change = 0;  ///< N m, size of the change of torque over the last third of the excursion
  double peak = 0;           ///< N m, side * torque that the excursion's 95th percentile has
  double position = 0;       ///< Hann-weighted mean over the window
  double arrival = 0;        ///< the same at the excursion's begin, on the way to the peak
  double spread = 0;         ///< standard deviation over the window
  double earlier_position = 0, earlier_spread = 0;  ///< the same, half a window earlier
  /// rms about a straight line, from the window's begin until torque falls below half the level
  double ringing = 0;
};

/// Reads the wall of one excursion. The window is the last third of the excursion, shortened so that torque
/// changes by at most `torque_span` [N m, > 0] within it, never below four samples where the excursion has
/// them. `level` is the one that the excursion was found with, `limit` the first sample of the next excursion
/// (or the number of samples).
WallReading read_wall(const LockedMotion& motion, const TorqueExcursion& excursion, double level,
                      double torque_span, std::size_t limit);

}  // namespace backlash::diagnosis
