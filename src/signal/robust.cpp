// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/robust.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::signal {
namespace {

constexpr double kClip = 3.5;  // choice: standard deviations; of normal values one in 2000 lies beyond

}  // namespace

RobustScale robust_scale(const std::vector<double>& values, double floor) {
  RobustScale scale;
  scale.centre = median(values);
  std::vector<double> distances;
  distances.reserve(values.size());
  for (const double value : values) distances.push_back(std::abs(value - scale.centre));
  scale.clip = kClip * kNormalPerMedianDeviation * median(distances) + floor;
  double squares = 0;
  for (const double distance : distances) {
    squares += std::pow(std::min(distance, scale.clip), 2);
    if (distance > scale.clip) ++scale.outliers;
  }
  if (values.size() > 1) scale.deviation = std::sqrt(squares / static_cast<double>(values.size() - 1));
  return scale;
}

}  // namespace backlash::signal
