// SPDX-License-Identifier: BSD-3-Clause
#include "onset_threshold.h"

#include <cmath>

#include "backlash_diagnosis/signal/distributions.h"

namespace backlash::changes {
namespace {

constexpr double kDiscrete = 0.583;  // Siegmund 1985, 10.4: -zeta(1/2) / sqrt(2 pi)
constexpr int kSteps = 64;           // of the integral over ln x, whose integrand is smooth
constexpr double kMostGain = 500;    // beyond 1e-100

}  // namespace

double chance_of_gain(double gain, double values, double fewest, double most) {
  const double b = std::sqrt(gain), step = 0.5 * std::log(most / fewest) / kSteps;
  double integral = 0;
  for (int i = 0; i < kSteps; ++i)
    integral += step * std::exp(-kDiscrete * b / std::sqrt(most) * std::exp((i + 0.5) * step));
  const double density =
      std::exp(values * std::log(b) - gain / 2 - (values / 2 - 1) * std::log(2.0) - std::lgamma(values / 2));
  return 1 - signal::chi_square_probability(gain, values) + density * integral;
}

double gain_by_chance(double probability, double values, double fewest, double most) {
  double low = values, high = kMostGain;  // falls beyond gains of `values`
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (chance_of_gain(middle, values, fewest, most) > probability ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace backlash::changes
