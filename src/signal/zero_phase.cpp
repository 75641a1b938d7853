// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/zero_phase.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "backlash_diagnosis/base/error.h"

namespace backlash::signal {
namespace {

/// A section b (1 + z^-1)^2 / (1 + a1 z^-1 + a2 z^-2), gain 1 at rest.
struct Section {
  double gain, a1, a2;
  double s1 = 0, s2 = 0;

  double next(double x) {
    const double y = gain * x + s1;
    s1 = 2 * gain * x - a1 * y + s2;
    s2 = gain * x - a2 * y;
    return y;
  }

  /// As if x had been applied forever.
  void settle(double x) {
    s2 = (gain - a2) * x;
    s1 = (2 * gain - a1) * x + s2;
  }
};

using Filter = std::array<Section, 2>;  // order 4

/// Bilinear transform of the Butterworth poles at 5/8 pi and 7/8 pi.
Filter butterworth(double interval, double cutoff) {
  Filter filter;
  const double w = std::tan(M_PI * cutoff * interval);
  for (std::size_t i = 0; i < filter.size(); ++i) {
    const double damping = -2 * std::cos(M_PI * (5 + 2.0 * double(i)) / 8);
    const double norm = 1 + damping * w + w * w;
    filter[i] = {w * w / norm, 2 * (w * w - 1) / norm, (1 - damping * w + w * w) / norm};
  }
  return filter;
}

void run(Filter filter, std::vector<double>& values) {
  for (Section& section : filter) section.settle(values.front());
  for (double& value : values)
    for (Section& section : filter) value = section.next(value);
}

void require_interval(double interval) {
  if (!(interval > 0) || !std::isfinite(interval))
    throw InvalidParameter("interval", interval, "must be > 0 s");
}

}  // namespace

std::vector<double> low_pass(const std::vector<double>& values, double interval, double cutoff) {
  require_interval(interval);
  if (!(cutoff > 0 && cutoff < 0.5 / interval))
    throw InvalidParameter("cutoff", cutoff, "must be > 0 and below half of the sampling rate");
  if (values.size() < 2) return values;
  const std::size_t n = values.size();
  const std::size_t pad =
      std::min(n - 1, static_cast<std::size_t>(std::ceil(3 / (2 * M_PI * cutoff * interval) * 4)));
  std::vector<double> padded;
  padded.reserve(n + 2 * pad);
  for (std::size_t k = pad; k > 0; --k) padded.push_back(2 * values.front() - values[k]);
  padded.insert(padded.end(), values.begin(), values.end());
  for (std::size_t k = 1; k <= pad; ++k) padded.push_back(2 * values.back() - values[n - 1 - k]);
  const Filter filter = butterworth(interval, cutoff);
  for (int pass = 0; pass < 2; ++pass) {
    run(filter, padded);
    std::reverse(padded.begin(), padded.end());
  }
  return {padded.begin() + pad, padded.begin() + pad + n};
}

std::vector<double> derivative(const std::vector<double>& values, double interval) {
  require_interval(interval);
  const std::size_t n = values.size();
  if (n < 3) throw InvalidParameter("derivative", double(n), "needs at least three values");
  std::vector<double> rate(n);
  for (std::size_t k = 1; k + 1 < n; ++k) rate[k] = (values[k + 1] - values[k - 1]) / (2 * interval);
  rate[0] = (-3 * values[0] + 4 * values[1] - values[2]) / (2 * interval);
  rate[n - 1] = (3 * values[n - 1] - 4 * values[n - 2] + values[n - 3]) / (2 * interval);
  return rate;
}

std::vector<double> delayed(const std::vector<double>& values, double samples) {
  const long n = static_cast<long>(values.size());
  const double whole = std::floor(-samples), t = -samples - whole;
  const auto at = [&](long k) { return values[std::clamp(k, 0L, n - 1)]; };
  std::vector<double> out(values.size());
  for (long k = 0; k < n; ++k) {
    const long j = k + static_cast<long>(whole);
    const double a = at(j - 1), b = at(j), c = at(j + 1), d = at(j + 2);
    out[k] = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
  }
  return out;
}

}  // namespace backlash::signal
