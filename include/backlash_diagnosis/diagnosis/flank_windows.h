// SPDX-License-Identifier: BSD-3-Clause
// Records with two encoders, averaged over short windows with triangular weights, for which acceleration is
// exactly a second difference of positions: nothing is differentiated by sample.
#pragma once

#include <cstddef>
#include <vector>

namespace backlash::diagnosis {

/// Samples at equal distances `interval` [s], all columns of the same length, finite. `unbroken[i]` is false
/// where samples i - 1 and i are not neighbours in time.
struct TwoEncoders {
  double interval = 0;
  std::vector<double> torque, motor, load;  // N m, rad, rad
  std::vector<char> unbroken;
};

/// Averages over 2 * half - 1 samples, one window every `half` samples.
struct FlankWindows {
  std::vector<std::size_t> centre;                                          // sample
  std::vector<double> torque, deflection, load, speed, slip, acceleration;  // slip: motor minus load speed
  std::vector<double> load_acceleration;
  std::vector<double> least, largest;  // rad, deflection of its samples
  std::vector<double> rough;           // rad, amplitude by which it alternates from sample to sample, mean
  std::size_t size() const { return centre.size(); }
};
FlankWindows average_windows(const TwoEncoders& motion, std::size_t half);

/// The torque that the motion of the whole machine takes, in the gap as on the flanks,
///   tau = J_M a_M + J_L a_L + d w_M + C sign(w_M) + h(q_L),
/// fitted to the recorded one, instead of it: free of its noise, and wrong where the machine has more.
/// Two-stage least squares, the load's motion as instrument (Theil 1953).
FlankWindows with_balanced_torque(FlankWindows windows);

}  // namespace backlash::diagnosis
