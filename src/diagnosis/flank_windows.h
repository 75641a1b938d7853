// SPDX-License-Identifier: BSD-3-Clause
// Records with two encoders, averaged over short windows with triangular weights, for which acceleration is
// exactly a second difference of positions: nothing is differentiated by sample.
#pragma once

#include <cstddef>
#include <vector>

namespace backlash::diagnosis {

/// Samples at equal distances `interval` [s], all columns of the same length, finite, at the motor's axis.
/// `recorded[i]` is false where the sample was lost and is interpolated.
struct TwoEncoders {
  double interval = 0;
  std::vector<double> torque, motor, load;  // N m, rad, rad
  std::vector<char> recorded;
};

/// Averages over 2 * half - 1 samples, one window every `half` samples, without lost ones.
struct FlankWindows {
  std::size_t half = 0;
  std::vector<std::size_t> centre;                      // sample
  std::vector<double> torque, deflection, motor, load;  // deflection: motor minus load position
  std::vector<double> speed, load_speed;                // rad/s
  std::vector<double> acceleration, load_acceleration;  // rad/s^2
  std::vector<double> range, rough;  // rad, of the deflection of its samples; by which they alternate, mean
  std::size_t size() const { return centre.size(); }
};
FlankWindows average_windows(const TwoEncoders& motion, std::size_t half);

/// Piecewise linear functions of q on even knots. Each value lies between two of them: on `first` with the
/// weight 1 - share, on the next with `share`. `count` 0: none.
struct Hats {
  int count = 0;
  std::vector<int> first;
  std::vector<double> share;
};
/// At most `most` knots, each for `per_knot` values at least; none where that leaves fewer than three.
Hats position_hats(const std::vector<double>& q, int most, double per_knot);

}  // namespace backlash::diagnosis
