// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/signal_checks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/spectrum.h"

namespace backlash::diagnosis {
namespace {

constexpr std::size_t kMaxSamples = 1 << 16;  // per search; a longer record is searched in growing stretches
constexpr double kNearly =
    0.75;  // a period that is no whole number of samples correlates less than its multiples

/// Values at `count` equidistant times from the first stamp on, linear in between.
std::vector<double> resample(const std::vector<double>& time, const std::vector<double>& signal,
                             double interval, std::size_t count) {
  std::vector<double> even(count);
  std::size_t i = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = time.front() + double(k) * interval;
    while (i + 2 < time.size() && time[i + 1] < t) ++i;
    const double share = std::clamp((t - time[i]) / (time[i + 1] - time[i]), 0.0, 1.0);
    even[k] = signal[i] + share * (signal[i + 1] - signal[i]);
  }
  return even;
}

/// Autocorrelation at lags 0 .. `lags`, each normalised by the power of the two stretches that it compares: 1
/// where they are equal, less elsewhere, also in a record of a few periods. 0 where one of them is still.
std::vector<double> autocorrelation(const std::vector<double>& x, std::size_t lags) {
  const std::size_t n = x.size();
  std::vector<double> power(n + 1, 0.0);  // of the first samples
  for (std::size_t i = 0; i < n; ++i) power[i + 1] = power[i] + x[i] * x[i];
  const std::vector<double> product = signal::lagged_products(x, lags);
  std::vector<double> r(lags + 1, 0.0);
  for (std::size_t lag = 0; lag <= lags; ++lag) {
    const double early = power[n - lag], late = power[n] - power[lag];
    if (std::min(early, late) > 1e-9 * power[n]) r[lag] = product[lag] / std::sqrt(early * late);
  }
  return r;
}

/// Ringing that dies out repeats too, but is no excitation.
bool dies_out(const std::vector<double>& x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  const double early = std::inner_product(x.begin(), middle, x.begin(), 0.0);
  const double late = std::inner_product(middle, x.end(), middle, 0.0);
  return late < 0.1 * early;
}

/// Lag of the first maximum of the autocorrelation that is nearly as high as the highest; 0 where there is
/// none.
std::size_t repetition_lag(std::vector<double> x) {
  const std::size_t n = x.size();
  if (n < 8) return 0;
  const double mean = std::accumulate(x.begin(), x.end(), 0.0) / double(n);
  for (double& v : x) v -= mean;
  if (dies_out(x)) return 0;
  const std::size_t longest = n / 2 + 1;  // of a lag: two periods, the last sample of which may be missing
  // A little beyond, so that a hill at the longest lag is distinguished from one that still rises there.
  const std::vector<double> r = autocorrelation(x, std::min(n - 1, longest + n / 16 + 2));
  std::size_t first = 1;
  while (first <= longest && r[first] > 0) ++first;  // past the first zero: the lobe around lag 0
  if (first > longest) return 0;
  const double highest = *std::max_element(r.begin() + first, r.begin() + longest + 1);
  if (!(highest >= 0.5)) return 0;
  std::size_t rise = first;
  while (r[rise] < kNearly * highest) ++rise;
  // The top of this first hill; noise may put smaller ones on its slope.
  const auto end = r.begin() + std::min(r.size(), rise + rise / 4 + 2);
  const std::size_t lag = std::max_element(r.begin() + rise, end) - r.begin();
  return lag <= longest ? lag : 0;
}

}  // namespace

std::optional<double> detect_period(const std::vector<double>& time, const std::vector<double>& signal) {
  if (time.size() < 8 || signal.size() != time.size()) return std::nullopt;
  for (const double v : signal)
    if (!std::isfinite(v)) return std::nullopt;
  const auto [low, high] = signal::extent(signal);
  if (!(high - low > 1e-9 * (std::fabs(high) + std::fabs(low)))) return std::nullopt;  // constant
  const double interval = record::median_interval(time), span = time.back() - time.front();
  if (!(interval > 0)) return std::nullopt;
  const double samples = span / interval + 1;
  // A long record is first searched in its beginning, at full resolution, then in stretches of twice the
  // length at half the resolution: what is found then has a lag of thousands of steps.
  for (double stride = 1;; stride *= 2) {
    const bool all = samples <= stride * kMaxSamples;
    const auto count = all ? static_cast<std::size_t>(std::lround(samples / stride)) : kMaxSamples;
    const std::size_t lag = repetition_lag(resample(time, signal, stride * interval, count));
    // Unless the excitation began late: then the end of the record shows it at full resolution.
    if (lag > 0 && stride > 1 && double(lag) * stride < 0.25 * double(kMaxSamples)) {
      const auto tail = static_cast<std::ptrdiff_t>(std::min(time.size(), kMaxSamples / 2));
      if (const auto fine =
              detect_period({time.end() - tail, time.end()}, {signal.end() - tail, signal.end()}))
        return fine;
    }
    if (lag > 0) return double(lag) * stride * interval;
    if (all) return std::nullopt;
  }
}

double signal_level(std::vector<double> signal) {
  signal.erase(std::remove_if(signal.begin(), signal.end(), [](double v) { return std::isnan(v); }),
               signal.end());
  return signal.empty() ? 0 : signal::median_magnitude(std::move(signal));
}

namespace {

/// Runs of at least 3 samples at one value.
struct Runs {
  std::size_t samples = 0;  // at the value, in runs or not
  int count = 0;
  int hard = 0;  // runs that the signal entered at a speed that would have carried it past the value
};

Runs runs_at(const std::vector<double>& signal, double value, double step) {
  Runs runs;
  for (std::size_t begin = 0; begin < signal.size();) {
    if (signal[begin] != value) {
      ++begin;
      continue;
    }
    std::size_t end = begin;
    while (end < signal.size() && signal[end] == value) ++end;
    runs.samples += end - begin;
    if (end - begin >= 3) {
      ++runs.count;
      if (begin >= 2) {
        const double before = signal[begin - 1], speed = before - signal[begin - 2];
        if (std::fabs(speed) > std::fabs(value - before) + 2 * step) ++runs.hard;
      }
    }
    begin = end;
  }
  return runs;
}

}  // namespace

bool looks_saturated(const std::vector<double>& signal) {
  if (signal.size() < 8) return false;
  const auto [low, high] = signal::extent(signal);
  if (low == high) return false;
  const double step = signal::smallest_step(signal);
  for (const double extreme : {low, high}) {
    const Runs runs = runs_at(signal, extreme, step);
    // Some runs begin slowly also with a saturated sensor, where the signal happens to turn near its limit.
    if (runs.hard > 0 && 3 * runs.hard >= runs.count && runs.samples * 200 > signal.size()) return true;
  }
  return false;
}

}  // namespace backlash::diagnosis
