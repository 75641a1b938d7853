// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/error_memory.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace backlash::signal {
namespace {

constexpr std::array<double, 5> kIndependentShares = {0.02, 0.25, 0.5, 0.75, 0.9};  // and 1
constexpr std::size_t kTimeConstants = 12;

/// One way in which errors may hang together.
struct Memory {
  double independent = 1;    // share of the variance
  double time_constant = 1;  // s, of the rest
};

/// Restricted log likelihood of the residuals, up to a constant; their size is profiled out.
double likelihood(const Memory& memory, const std::vector<double>& times,
                  const std::vector<double>& residuals) {
  const double slow = 1 - memory.independent, middle = 0.5 * (times.front() + times.back()),
               scale = times.back() - times.front();
  std::array<double, 3> state{};  // of the filter, for the residuals, a constant and a slope
  std::array<std::array<double, 3>, 3> product{};
  double variance = slow, log_determinant = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (i > 0) {
      const double kept = std::exp(-(times[i] - times[i - 1]) / memory.time_constant);
      for (double& value : state) value *= kept;
      variance = kept * kept * variance + slow * (1 - kept * kept);
    }
    const double total = variance + memory.independent, gain = variance / total;
    std::array<double, 3> innovation = {residuals[i], 1, (times[i] - middle) / scale};
    for (std::size_t k = 0; k < 3; ++k) {
      innovation[k] -= state[k];
      state[k] += gain * innovation[k];
    }
    variance *= 1 - gain;
    log_determinant += std::log(total);
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b <= a; ++b) product[a][b] += innovation[a] * innovation[b] / total;
  }
  const double determinant = product[1][1] * product[2][2] - product[2][1] * product[2][1];
  const double explained =
      (product[1][0] * product[1][0] * product[2][2] - 2 * product[1][0] * product[2][0] * product[2][1] +
       product[2][0] * product[2][0] * product[1][1]) /
      determinant;
  const double squares = std::max(product[0][0] - explained, 1e-300);
  return -0.5 * (log_determinant + std::log(determinant) +
                 static_cast<double>(times.size() - 2) * std::log(squares));
}

/// x'Rx / x'x for the correlations R of the errors.
double inflation(const Memory& memory, const std::vector<double>& times, const std::vector<double>& x) {
  double squares = 0, crossed = 0, before = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (i > 0) before = (before + x[i - 1]) * std::exp(-(times[i] - times[i - 1]) / memory.time_constant);
    squares += x[i] * x[i];
    crossed += x[i] * before;
  }
  return 1 + 2 * (1 - memory.independent) * crossed / squares;
}

std::vector<Memory> grid(const std::vector<double>& times) {
  const double span = times.back() - times.front();
  const double shortest = 0.5 * span / static_cast<double>(times.size() - 1), longest = 0.5 * span;
  std::vector<Memory> all;
  for (const double share : kIndependentShares)
    for (std::size_t k = 0; k < kTimeConstants; ++k)
      all.push_back(
          {share, shortest * std::pow(longest / shortest, static_cast<double>(k) / (kTimeConstants - 1))});
  // As likely beforehand as each other share.
  for (std::size_t k = 0; k < kTimeConstants; ++k) all.push_back({1, span});
  return all;
}

}  // namespace

ErrorMemory error_memory(const std::vector<double>& times, const std::vector<double>& residuals) {
  const std::vector<Memory> all = grid(times);
  std::vector<double> logs;
  for (const Memory& memory : all) logs.push_back(likelihood(memory, times, residuals));
  const double best = *std::max_element(logs.begin(), logs.end());
  const std::vector<double> ones(times.size(), 1);
  std::vector<double> ranks;  // Kendall's statistic weighs by the order of times
  for (std::size_t i = 0; i < times.size(); ++i)
    ranks.push_back(static_cast<double>(i) - 0.5 * static_cast<double>(times.size() - 1));
  ErrorMemory mean{0, 0};
  double weights = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const double weight = std::exp(logs[k] - best);
    if (weight < 1e-4) continue;
    mean.slope += weight * inflation(all[k], times, ranks);
    mean.level += weight * inflation(all[k], times, ones);
    weights += weight;
  }
  return {mean.slope / weights, mean.level / weights};
}

}  // namespace backlash::signal
