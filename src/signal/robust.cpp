// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/robust.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash {

RobustScale robust_scale(const std::vector<double>& values, double floor) {
  RobustScale scale;
  scale.centre = median(values);
  std::vector<double> distances;
  distances.reserve(values.size());
  for (const double value : values) distances.push_back(std::abs(value - scale.centre));
  scale.clip = 3.5 * kNormalPerMedianDeviation * median(distances) +
               floor;  // 1.4826: standard deviation over median absolute deviation
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
