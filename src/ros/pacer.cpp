// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/pacer.h"

#include <algorithm>
#include <cmath>

namespace backlash::ros_bridge {

using std::chrono::nanoseconds;

nanoseconds sample_time(long k, double rate) {
  return nanoseconds(std::llround(static_cast<long double>(k) * 1e9L / static_cast<long double>(rate)));
}

bool Pacer::is_due(long k, nanoseconds elapsed) const {
  return rate_ == 0 || sample_time(k, rate_) <= elapsed;
}

nanoseconds Pacer::lag(long k, nanoseconds elapsed) const {
  return rate_ == 0 ? nanoseconds(0) : std::max(nanoseconds(0), elapsed - sample_time(k, rate_));
}

nanoseconds Pacer::wait(long k, nanoseconds elapsed) const {
  return rate_ == 0 ? nanoseconds(0) : std::max(nanoseconds(0), sample_time(k, rate_) - elapsed);
}

}  // namespace backlash::ros_bridge
