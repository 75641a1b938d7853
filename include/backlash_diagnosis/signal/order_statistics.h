// SPDX-License-Identifier: BSD-3-Clause
// Order statistics, one definition for the whole package. Values must not be NaN.
#pragma once

#include <cstddef>
#include <vector>

namespace backlash::signal {

/// The value below which `fraction` [0, 1] of the values lie, linear between neighbours: of n sorted values
/// the one at place fraction * (n - 1), from 0 (Hyndman and Fan 1996, definition 7; the default of R and
/// NumPy). NaN without values.
double quantile(std::vector<double> values, double fraction);

/// quantile(values, 0.5): the middle value, or the mean of the two middle ones.
double median(std::vector<double> values);

/// median(|value|)
double median_magnitude(std::vector<double> values);

/// quantile(values, 1 - tail) - quantile(values, tail): the range of a signal without the fraction `tail` [0,
/// 0.5) at either end. NaN without values.
double quantile_range(std::vector<double> values, double tail);

/// Smallest and largest value; both 0 without values.
struct Extent {
  double low = 0, high = 0;
  double size() const { return high - low; }
};

Extent extent(const std::vector<double>& values);

/// Of the values from `begin` to before `end`.
Extent extent(const std::vector<double>& values, std::size_t begin, std::size_t end);

/// extent(values).size()
double peak_to_peak(const std::vector<double>& values);

/// Standard deviation of a normal distribution in units of its median absolute deviation.
constexpr double kNormalPerMedianDeviation = 1.482602218505602;

/// The smallest change between two successive values beyond `rounding` >= 0, the resolution of a sensor; 0
/// where none changes.
double smallest_step(const std::vector<double>& values, double rounding = 0);

}  // namespace backlash::signal
