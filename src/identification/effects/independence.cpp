// SPDX-License-Identifier: BSD-3-Clause
#include "independence.h"

#include <algorithm>
#include <cmath>

namespace backlash::identification {
namespace {

constexpr double kBand = 2.576;  // theory: standard deviations of 99 %
constexpr long kMemory =
    400;  // samples, choice: over which colour is summed, and at most a quarter of the record

double mean(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v;
  return sum / double(x.size());
}

std::vector<double> centred(std::vector<double> x) {
  const double m = mean(x);
  for (double& v : x) v -= m;
  return x;
}

/// sum x[k] y[k + lag] / n
double covariance(const std::vector<double>& x, const std::vector<double>& y, long lag) {
  const long n = long(x.size());
  double sum = 0;
  for (long k = std::max(0L, -lag); k < std::min(n, n - lag); ++k) sum += x[k] * y[k + lag];
  return sum / double(n);
}

}  // namespace

double share_outside_band(const std::vector<double>& residual, const std::vector<double>& input, int lags) {
  const std::vector<double> r = centred(residual), u = centred(input);
  const double rr = covariance(r, r, 0), uu = covariance(u, u, 0);
  if (!(rr > 0) || !(uu > 0)) return 0;
  const long memory = std::min(kMemory, long(r.size()) / 4);
  double variance = 1;
  for (long k = 1; k <= memory; ++k) variance += 2 * covariance(r, r, k) / rr * covariance(u, u, k) / uu;
  const double band = kBand * std::sqrt(std::max(variance, 1.0) / double(r.size()));
  int outside = 0;
  for (int lag = -lags; lag <= lags; ++lag)
    outside += std::fabs(covariance(r, u, lag)) / std::sqrt(rr * uu) > band;
  return double(outside) / double(2 * lags + 1);
}

}  // namespace backlash::identification
