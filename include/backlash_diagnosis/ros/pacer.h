// SPDX-License-Identifier: BSD-3-Clause
// When a sample of a simulation is due on a clock. Knows no ROS and reads no clock itself.
#pragma once

#include <chrono>

namespace backlash::ros_bridge {

/// Time of sample k after sample 0, each rounded to the nanosecond on its own, so that no error ever adds up.
/// `rate` samples per second, > 0; k >= 0, exact up to k = 1.8e10 for rates that divide a second into whole
/// nanoseconds.
std::chrono::nanoseconds sample_time(long k, double rate);

class Pacer {
 public:
  /// `rate` samples per second of the pacing clock; 0: without pace, every sample is due at once.
  explicit Pacer(double rate) : rate_(rate) {}

  /// Whether sample k is due when the clock has run for `elapsed` since sample 0 was.
  bool is_due(long k, std::chrono::nanoseconds elapsed) const;

  /// How long sample k has been due; 0 where it is not due yet or there is no pace.
  std::chrono::nanoseconds lag(long k, std::chrono::nanoseconds elapsed) const;

  /// How long until sample k is due; 0 where it is.
  std::chrono::nanoseconds wait(long k, std::chrono::nanoseconds elapsed) const;

 private:
  double rate_;
};

}  // namespace backlash::ros_bridge
