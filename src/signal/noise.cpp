// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::signal {
namespace {

constexpr int kStretch = 10;   // samples
constexpr int kCubic = 4;      // coefficients
constexpr double kCalm = 0.2;  // share of the stretches that counts
constexpr double kMedianOverCalm =
    2.5;  // 1.5 for white noise: median over 20 % quantile, 10 degrees of freedom
constexpr std::size_t kEnoughCalm = 20;   // stretches; with fewer, chance alone makes eigenvalues unequal
constexpr double kClearlyNotWhite = 0.5;  // with so many, the white share is above 0.6 for white noise

struct Stretch {
  double sum = 0;  // of squares
  std::size_t begin = 0;
  bool operator<(const Stretch& other) const { return sum < other.sum; }
};

using Samples = Eigen::Matrix<double, kStretch, 1>;

/// Sums of squares of all stretches, after `reduce`; stretches with a value that is not finite are left out.
template <typename Reduce>
std::vector<Stretch> stretches_of(const std::vector<double>& values, Reduce reduce) {
  std::vector<Stretch> stretches;
  for (std::size_t i = 0; i + kStretch <= values.size(); i += kStretch) {
    const double sum = reduce(Eigen::Map<const Samples>(&values[i]));
    if (std::isfinite(sum)) stretches.push_back({sum, i});
  }
  return stretches;
}

/// Puts the calmest stretches first and returns how many they are; the one after them is at the quantile.
std::size_t sort_calm(std::vector<Stretch>& stretches) {
  const auto calm = static_cast<std::size_t>(kCalm * double(stretches.size()));
  std::nth_element(stretches.begin(), stretches.begin() + static_cast<std::ptrdiff_t>(calm), stretches.end());
  return calm;
}

/// Share of the power of the first `calm` stretches that is white: smallest over mean eigenvalue of the
/// covariance of five successive values. A few oscillations leave the smallest eigenvalue to the white part.
double white_share(const std::vector<double>& values, const std::vector<Stretch>& stretches,
                   std::size_t calm) {
  constexpr int order = 5;
  Eigen::Matrix<double, order, order> covariance = Eigen::Matrix<double, order, order>::Zero();
  for (std::size_t s = 0; s < calm; ++s)
    for (std::size_t i = stretches[s].begin; i + order <= stretches[s].begin + kStretch; ++i) {
      const Eigen::Map<const Eigen::Matrix<double, order, 1>> successive(&values[i]);
      covariance += successive * successive.transpose();
    }
  const double mean = covariance.trace() / order;
  if (!(mean > 0)) return 1;
  return std::max(0.0, symmetric_eigenvalues(covariance)[0]) / mean;
}

/// From period to period; nothing with fewer than two periods.
std::optional<NoiseRange> between_periods(const std::vector<double>& signal, double samples_per_period) {
  if (!(samples_per_period >= kStretch && samples_per_period <= 0.5 * double(signal.size())))
    return std::nullopt;
  const auto lag = static_cast<std::size_t>(std::lround(samples_per_period));
  std::vector<double> change;
  for (std::size_t i = 0; i + lag < signal.size(); ++i) change.push_back(signal[i + lag] - signal[i]);
  auto stretches = stretches_of(change, [](const Samples& d) { return d.squaredNorm(); });
  if (stretches.empty()) return std::nullopt;
  const std::size_t calm = sort_calm(stretches);
  const double quantile = stretches[calm].sum;
  const double variance = quantile / chi_square_quantile(kCalm, kStretch) /
                          2;  // a difference of two samples has twice the variance
  const double white = calm >= kEnoughCalm ? white_share(change, stretches, calm) : 1;
  if (white < kClearlyNotWhite) return NoiseRange{0, std::sqrt(variance * white)};
  const auto middle = stretches.begin() + static_cast<std::ptrdiff_t>(stretches.size() / 2);
  std::nth_element(stretches.begin(), middle, stretches.end());
  const bool repeats = middle->sum <= kMedianOverCalm * quantile;
  return NoiseRange{repeats ? std::sqrt(variance) : 0, std::sqrt(variance)};
}

/// Orthonormal cubics over a stretch.
Eigen::MatrixXd cubics() {
  Eigen::MatrixXd powers(kStretch, kCubic);
  for (int i = 0; i < kStretch; ++i)
    for (int k = 0; k < kCubic; ++k) powers(i, k) = std::pow((i - 4.5) / 4.5, k);
  return orthonormal_basis(powers);
}

/// Within a period; NaN without a stretch.
double within_period(const std::vector<double>& signal) {
  static const Eigen::Matrix<double, kStretch, kCubic> cubic = cubics();
  auto stretches = stretches_of(
      signal, [](const Samples& x) { return (x - cubic * (cubic.transpose() * x)).squaredNorm(); });
  if (stretches.empty()) return NoiseRange().upper;
  return std::sqrt(stretches[sort_calm(stretches)].sum / chi_square_quantile(kCalm, kStretch - kCubic));
}

}  // namespace

std::vector<double> differences(std::vector<double> values, int order) {
  for (; order > 0 && !values.empty(); --order) {
    for (std::size_t k = 0; k + 1 < values.size(); ++k) values[k] = values[k + 1] - values[k];
    values.pop_back();
  }
  return values;
}

double noise_from_differences(const std::vector<double>& values, int order) {
  double variance = 1;  // binomial(2 order, order), of the differences of white noise of variance 1
  for (int k = 1; k <= order; ++k) variance *= static_cast<double>(order + k) / k;
  return kNormalPerMedianDeviation * median_magnitude(differences(values, order)) / std::sqrt(variance);
}

NoiseRange estimate_noise(const std::vector<double>& signal, double samples_per_period) {
  const double within = within_period(signal);
  const auto between = between_periods(signal, samples_per_period);
  if (!between) return {0, within};
  return {std::min(between->lower, within), std::min(between->upper, within)};
}

NoiseRange with_standard_error(const NoiseRange& range, std::size_t samples) {
  const double stretches = std::max(1.0, static_cast<double>(samples) / 10);
  const double relative = std::min(1.0, 2 * 0.52 / std::sqrt(stretches));
  return {range.lower * (1 - relative), range.upper * (1 + relative)};
}

}  // namespace backlash::signal
