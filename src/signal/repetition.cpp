// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/repetition.h"

#include <algorithm>
#include <cmath>

namespace backlash::signal {
namespace {

constexpr std::size_t kCoarse = 2000;  // choice (time): samples of the first search
constexpr double kLeastShared = 0.2;   // choice: of the signal
constexpr double kUnlike =
    1.0;  // theory: of sqrt(2) standard deviations, where a signal has nothing left of itself
constexpr double kWorseSpeed = 10;         // choice: times the mismatch of the position
constexpr std::size_t kFewestPairs = 100;  // choice

double deviation(const std::vector<double>& x) {
  double mean = 0, square = 0;
  for (const double value : x) mean += value / double(x.size());
  for (const double value : x) square += (value - mean) * (value - mean);
  return std::sqrt(square / std::max<double>(1, double(x.size())));
}

/// rms of x(t + lag) - x(t) over standard deviations of x.
double mismatch(const std::vector<double>& x, std::size_t lag, double deviation) {
  double square = 0;
  for (std::size_t k = 0; k + lag < x.size(); ++k) square += (x[k + lag] - x[k]) * (x[k + lag] - x[k]);
  return std::sqrt(square / double(x.size() - lag)) / deviation;
}

std::vector<double> every(const std::vector<double>& x, std::size_t stride) {
  std::vector<double> out;
  for (std::size_t k = 0; k < x.size(); k += stride) out.push_back(x[k]);
  return out;
}

/// Over `length` samples: what a quantised position is fast enough to show.
std::vector<double> differences(const std::vector<double>& x, std::size_t length) {
  std::vector<double> out;
  for (std::size_t k = 0; k + length < x.size(); ++k) out.push_back(x[k + length] - x[k]);
  return out;
}

/// The best lag from `first` to `last`.
std::size_t best_lag(const std::vector<double>& x, std::size_t first, std::size_t last, double deviation) {
  std::size_t best = first;
  double least = INFINITY;
  for (std::size_t lag = first; lag <= last; ++lag)
    if (const double m = mismatch(x, lag, deviation); m < least) least = m, best = lag;
  return best;
}

}  // namespace

std::optional<std::size_t> repetition(const std::vector<double>& position, double most) {
  const std::size_t n = position.size(), stride = n / kCoarse + 1;
  const double size = deviation(position);
  if (n < kFewestPairs || !(size > 0)) return std::nullopt;
  const std::vector<double> coarse = every(position, stride);
  const auto longest = std::size_t((1 - kLeastShared) * double(coarse.size()));
  std::size_t unlike = 1;
  while (unlike < longest && mismatch(coarse, unlike, size) < kUnlike) ++unlike;
  if (unlike >= longest) return std::nullopt;
  const std::size_t about = stride * best_lag(coarse, unlike, longest, size);
  const std::size_t lag = best_lag(position, about - stride + 1, about + stride - 1, size);
  if (mismatch(position, lag, size) > most) return std::nullopt;
  const std::vector<double> speed = differences(position, stride);
  if (mismatch(speed, lag, deviation(speed)) > kWorseSpeed * most) return std::nullopt;
  return lag;
}

double repeated_noise(const std::vector<double>& values, const std::vector<char>& counts, std::size_t lag) {
  double sum = 0, square = 0;
  std::size_t pairs = 0;
  for (std::size_t k = 0; k + lag < values.size(); ++k) {
    if (!counts[k] || !counts[k + lag]) continue;
    const double difference = values[k + lag] - values[k];
    sum += difference, square += difference * difference, ++pairs;
  }
  if (pairs < kFewestPairs) return 0;
  const double mean = sum / double(pairs);
  return std::sqrt(std::max(0.0, square / double(pairs) - mean * mean) / 2);
}

}  // namespace backlash::signal
