// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/robust.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace backlash {

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double rank = std::round(fraction * static_cast<double>(values.size() - 1));
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const double upper = *middle;
  if (values.size() % 2 == 1) return upper;
  return 0.5 * (upper + *std::max_element(values.begin(), middle));
}

double smallest_step(const std::vector<double>& values) {
  double smallest = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = std::abs(values[i] - values[i - 1]);
    if (step > 0 && (smallest == 0 || step < smallest)) smallest = step;
  }
  return smallest;
}

RobustScale robust_scale(const std::vector<double>& values, double floor) {
  RobustScale scale;
  scale.centre = median(values);
  std::vector<double> distances;
  distances.reserve(values.size());
  for (const double value : values) distances.push_back(std::abs(value - scale.centre));
  scale.clip =
      3.5 * 1.4826 * median(distances) + floor;  // 1.4826: standard deviation over median absolute deviation
  double squares = 0;
  for (const double distance : distances) {
    squares += std::pow(std::min(distance, scale.clip), 2);
    if (distance > scale.clip) ++scale.outliers;
  }
  if (values.size() > 1) scale.deviation = std::sqrt(squares / static_cast<double>(values.size() - 1));
  return scale;
}

double student_t_975(std::size_t degrees) {
  constexpr std::array<double, 4> kTable = {12.7062, 4.3027, 3.1824, 2.7764};
  if (degrees <= kTable.size()) return kTable[std::max<std::size_t>(degrees, 1) - 1];
  const double z = 1.959964, n = static_cast<double>(degrees), z3 = z * z * z, z5 = z3 * z * z,
               z7 = z5 * z * z;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n * n * n);
}

}  // namespace backlash
