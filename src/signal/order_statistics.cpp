// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/order_statistics.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/not_a_number.h"

namespace backlash::signal {
namespace {

/// Values of the place `rank` [0, n - 1] and, where that is no whole number, between it and the next.
double at_rank(std::vector<double>& values, double rank) {
  const auto below = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), below, values.end());
  const double part = rank - std::floor(rank);
  if (part == 0) return *below;
  return *below + part * (*std::min_element(below + 1, values.end()) - *below);
}

}  // namespace

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return kNaN;
  return at_rank(values, fraction * static_cast<double>(values.size() - 1));
}

double median(std::vector<double> values) {
  return quantile(std::move(values), 0.5);
}

double median_magnitude(std::vector<double> values) {
  for (double& value : values) value = std::fabs(value);
  return median(std::move(values));
}

double quantile_range(std::vector<double> values, double tail) {
  if (values.empty()) return kNaN;
  const double last = static_cast<double>(values.size() - 1);
  const double upper = at_rank(values, (1 - tail) * last);
  return upper - at_rank(values, tail * last);
}

Extent extent(const std::vector<double>& values) {
  return extent(values, 0, values.size());
}

Extent extent(const std::vector<double>& values, std::size_t begin, std::size_t end) {
  if (begin >= end) return {};
  const auto first = values.begin();
  const auto [low, high] = std::minmax_element(first + static_cast<std::ptrdiff_t>(begin),
                                               first + static_cast<std::ptrdiff_t>(end));
  return {*low, *high};
}

double peak_to_peak(const std::vector<double>& values) {
  return extent(values).size();
}

double smallest_step(const std::vector<double>& values, double rounding) {
  double smallest = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = std::abs(values[i] - values[i - 1]);
    if (step > rounding && (smallest == 0 || step < smallest)) smallest = step;
  }
  return smallest;
}

}  // namespace backlash::signal
