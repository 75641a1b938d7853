// SPDX-License-Identifier: BSD-3-Clause
#include "unseen_gain.h"

#include <cmath>
#include <numeric>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::identification {

Left left(const ServoPrediction& p, bool deflection, const BeliefSettings& settings) {
  const auto blocks = std::size_t(settings.blocks);
  const std::vector<double>& measured = deflection ? p.measured_deflection : p.measured_torque;
  const std::vector<double>& predicted = deflection ? p.deflection : p.torque;
  const std::vector<char>& counts = deflection ? p.settled : p.counts;
  const double floor = deflection ? p.deflection_floor : p.torque_floor;
  Left sum{std::vector<double>(blocks, 0.0)};
  for (std::size_t k = 0; k < measured.size(); ++k) {
    if (!counts[k]) continue;
    sum.square[k * blocks / measured.size()] += std::pow(measured[k] - predicted[k], 2);
    sum.noise += floor * floor;
  }
  return sum;
}

double Left::total() const {
  return std::accumulate(square.begin(), square.end(), 0.0);
}

TestGain test_gain(const Left& before, const Left& after, const BeliefSettings& settings) {
  const auto gain = [](double b, double a) { return b > 0 ? 1 - std::sqrt(a / b) : 0; };
  const std::size_t n = before.square.size();
  Random random(settings.seed);
  std::vector<double> gains;
  for (int draw = 0; draw < settings.draws; ++draw) {
    double b = 0, a = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t block = random.below(n);
      b += before.square[block], a += after.square[block];
    }
    gains.push_back(gain(b, a));
  }
  return {gain(before.total(), after.total()), signal::quantile(gains, 0.5 * settings.risk),
          signal::quantile(gains, 1 - 0.5 * settings.risk)};
}

}  // namespace backlash::identification
