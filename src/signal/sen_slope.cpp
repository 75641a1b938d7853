// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/sen_slope.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/not_a_number.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::signal {
namespace {

double term(double count) {
  return count * (count - 1) * (2 * count + 5) / 18;
}

}  // namespace

SenSlope::SenSlope(const std::vector<double>& times, const std::vector<double>& values)
    : variance_(term(static_cast<double>(times.size()))) {
  slopes_.reserve(times.size() * (times.size() - 1) / 2);
  for (std::size_t i = 0; i < times.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (times[i] > times[j]) slopes_.push_back((values[i] - values[j]) / (times[i] - times[j]));
  std::sort(slopes_.begin(), slopes_.end());
  for (auto tie = times.begin(); tie != times.end();) {
    const auto next = std::upper_bound(tie, times.end(), *tie);
    variance_ -= term(static_cast<double>(next - tie));
    tie = next;
  }
}

double SenSlope::value() const {
  const std::size_t middle = slopes_.size() / 2;
  return slopes_.size() % 2 == 1 ? slopes_[middle] : 0.5 * (slopes_[middle - 1] + slopes_[middle]);
}

SenSlope::Interval SenSlope::interval(double inflation) const {
  const double reach = kNormalQuantile975 * std::sqrt(inflation * variance_);
  // The M-th smallest and the M-th largest slope.
  const double m = std::floor(0.5 * (static_cast<double>(slopes_.size()) - reach));
  if (!(m >= 1)) return {kNaN, kNaN};
  const auto place = static_cast<std::size_t>(m);
  return {slopes_[place - 1], slopes_[slopes_.size() - place]};
}

}  // namespace backlash::signal
