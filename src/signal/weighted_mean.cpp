// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/weighted_mean.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/distributions.h"

namespace backlash::signal {

WeightedMean weighted_mean(const std::vector<Measured>& values) {
  double weights = 0, sum = 0, chi2 = 0;
  for (const Measured& m : values) {
    const double weight = std::pow(m.standard_error, -2);
    weights += weight;
    sum += weight * m.value;
  }
  WeightedMean mean;
  mean.value = sum / weights;
  mean.standard_error = 1 / std::sqrt(weights);
  const double free = double(values.size()) - 1;
  if (free == 0) return mean;
  for (const Measured& m : values) chi2 += std::pow((m.value - mean.value) / m.standard_error, 2);
  mean.standard_error *= std::sqrt(std::max(1.0, chi2 / free));
  mean.chance = 1 - chi_square_probability(chi2, free);
  return mean;
}

}  // namespace backlash::signal
