#include "backlash_diagnosis/diagnosis/signal_checks.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <unsupported/Eigen/FFT>

namespace backlash {
namespace {

constexpr std::size_t kMaxSamples = 1 << 16;  // enough to find a period; more would only cost time

/// Values at `count` equidistant times from the first stamp on, linear in between.
std::vector<double> resample(const std::vector<double>& time, const std::vector<double>& signal, double interval,
                             std::size_t count) {
  std::vector<double> even(count);
  std::size_t i = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = time.front() + k * interval;
    while (i + 2 < time.size() && time[i + 1] < t) ++i;
    const double share = std::clamp((t - time[i]) / (time[i + 1] - time[i]), 0.0, 1.0);
    even[k] = signal[i] + share * (signal[i + 1] - signal[i]);
  }
  return even;
}

double median_of_differences(const std::vector<double>& time) {
  std::vector<double> differences(time.size() - 1);
  for (std::size_t i = 0; i + 1 < time.size(); ++i) differences[i] = time[i + 1] - time[i];
  std::nth_element(differences.begin(), differences.begin() + differences.size() / 2, differences.end());
  return differences[differences.size() / 2];
}

/// Autocorrelation at lags 0 .. n/2, unbiased (each lag divided by its number of pairs), 1 at lag 0.
std::vector<double> autocorrelation(std::vector<double> x) {
  const std::size_t n = x.size();
  double mean = 0;
  for (double v : x) mean += v / n;
  for (double& v : x) v -= mean;
  std::size_t padded = 1;
  while (padded < 2 * n) padded *= 2;
  x.resize(padded, 0.0);
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> spectrum;
  fft.fwd(spectrum, x);
  for (auto& line : spectrum) line = std::norm(line);
  std::vector<double> product;
  fft.inv(product, spectrum);
  std::vector<double> r(n / 2 + 1, 0.0);
  const double power = product[0] / n;
  if (!(power > 0)) return r;
  for (std::size_t lag = 0; lag < r.size(); ++lag) r[lag] = product[lag] / (n - lag) / power;
  return r;
}

}  // namespace

std::optional<double> detect_period(const std::vector<double>& time, const std::vector<double>& signal) {
  if (time.size() < 8 || signal.size() != time.size()) return std::nullopt;
  const auto [low, high] = std::minmax_element(signal.begin(), signal.end());
  if (!(*high - *low > 1e-9 * (std::fabs(*high) + std::fabs(*low)))) return std::nullopt;  // constant
  const double span = time.back() - time.front();
  double interval = median_of_differences(time);
  if (!(interval > 0) || !(span > 0)) return std::nullopt;
  const double wanted = span / interval + 1;
  const double step = wanted > kMaxSamples ? span / (kMaxSamples - 1) : interval;
  const std::size_t count = std::min<std::size_t>(kMaxSamples, static_cast<std::size_t>(std::lround(wanted)));
  const std::vector<double> r = autocorrelation(resample(time, signal, step, count));
  std::size_t first = 1;
  while (first < r.size() && r[first] > 0) ++first;  // past the first zero: the lobe around lag 0
  if (first >= r.size()) return std::nullopt;
  const double highest = *std::max_element(r.begin() + first, r.end());
  if (highest < 0.5) return std::nullopt;
  std::size_t rise = first;
  while (r[rise] < 0.9 * highest) ++rise;
  // The top of this first hill; noise may put smaller ones on its slope.
  const auto end = r.begin() + std::min(r.size(), rise + rise / 4 + 2);
  const std::size_t lag = std::max_element(r.begin() + rise, end) - r.begin();
  if (lag + 1 >= r.size()) return std::nullopt;  // still rising: less than two periods
  return std::max(1.0, std::round(lag * step / interval)) * interval;
}

double median_magnitude(std::vector<double> signal) {
  if (signal.empty()) return 0;
  for (double& v : signal) v = std::fabs(v);
  std::nth_element(signal.begin(), signal.begin() + signal.size() / 2, signal.end());
  return signal[signal.size() / 2];
}

std::optional<double> estimate_noise(const std::vector<double>& signal, double samples_per_period) {
  constexpr std::size_t kBlock = 10;
  constexpr double kQuantile = 0.2;
  constexpr double kChiSquare = 6.179;  // 20 % quantile of chi-square with 10 degrees of freedom
  const auto lag = static_cast<std::size_t>(std::lround(samples_per_period));
  if (lag < kBlock || signal.size() < 2 * lag) return std::nullopt;
  std::vector<double> sums;
  for (std::size_t i = 0; i + kBlock + lag <= signal.size(); i += kBlock) {
    double sum = 0;
    for (std::size_t j = i; j < i + kBlock; ++j) sum += (signal[j + lag] - signal[j]) * (signal[j + lag] - signal[j]);
    sums.push_back(sum);
  }
  const auto at = static_cast<std::ptrdiff_t>(kQuantile * sums.size());
  std::nth_element(sums.begin(), sums.begin() + at, sums.end());
  return std::sqrt(sums[at] / kChiSquare / 2);  // a difference of two samples has twice the variance
}

bool looks_saturated(const std::vector<double>& signal) {
  if (signal.size() < 8) return false;
  const auto [low, high] = std::minmax_element(signal.begin(), signal.end());
  if (*low == *high) return false;
  for (const double extreme : {*low, *high}) {
    std::size_t total = 0, run = 0, longest = 0;
    for (const double v : signal) {
      run = v == extreme ? run + 1 : 0;
      total += v == extreme;
      longest = std::max(longest, run);
    }
    if (longest >= 3 && total * 200 > signal.size()) return true;
  }
  return false;
}

}  // namespace backlash
