// SPDX-License-Identifier: BSD-3-Clause
// From the readings of single walls to one travel from wall to wall, with what makes it uncertain.
#pragma once

#include <cstddef>
#include <vector>

#include "backlash_diagnosis/diagnosis/wall_reading.h"

namespace backlash::diagnosis {

/// Median over the readings of one of their members.
double median_of(const std::vector<WallReading>& readings, double WallReading::*member);

/// Square wave rather than ramp or sine: torque rests within an excursion and passes between the sides at
/// once. `readings` belong to `excursions`.
bool is_switched(const std::vector<TorqueExcursion>& excursions, const std::vector<WallReading>& readings);

/// Linear drift of position [rad/s] common to both walls: median slope between readings of one side, half the
/// record apart. 0 with fewer than two readings on each side.
double drift_rate(const std::vector<WallReading>& readings);

/// All in rad; equations in lost_motion.h.
struct WallToWall {
  double value = 0;           ///< travel less the deflections of both walls, extrapolated where switched
  double travel = 0;          ///< median travel as measured
  double scatter = 0;         ///< half width of the 95 % interval by the scatter between passages
  double motion = 0;          ///< the same by ringing and settling
  double ringing = 0;         ///< rms of the position at one wall
  double step = 0;            ///< resolution of the position: the smallest change between two samples
  std::vector<double> plays;  ///< of each passage, in the order of time, without extrapolation
  std::size_t outliers = 0;

  /// All three sources together.
  double half_interval() const;
};

/// `deflections` [rad, per reading] are subtracted from the travel. Needs two readings per side.
WallToWall measure_wall_to_wall(const LockedMotion& motion, const std::vector<WallReading>& readings,
                                const std::vector<double>& deflections, bool switched);

}  // namespace backlash::diagnosis
