// SPDX-License-Identifier: BSD-3-Clause
// The slope of Theil and Sen: the median of the slopes between all pairs of points (Theil 1950; Sen 1968). Up
// to 29 % of the points may be wrong.
#pragma once

#include <vector>

namespace backlash::signal {

class SenSlope {
 public:
  /// `times` do not decrease, and are not all the same; as many `values`.
  SenSlope(const std::vector<double>& times, const std::vector<double>& values);

  double value() const;

  struct Interval {
    double lower, upper;  // 95 %; both NaN where the points are too few for one
  };
  /// All slopes that Kendall's test does not reject at 5 %, with the normal approximation and the variance
  /// for tied times (Sen 1968). `inflation` >= 1 multiplies that variance, for correlated errors
  /// (error_memory.h).
  Interval interval(double inflation) const;

 private:
  std::vector<double> slopes_;  // sorted
  double variance_ = 0;         // of Kendall's statistic
};

}  // namespace backlash::signal
