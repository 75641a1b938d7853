// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/spectrum.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "backlash_diagnosis/base/error.h"

namespace backlash::signal {
namespace {

using Complex = std::complex<double>;

constexpr double kOverlap = 1.0 / 6;       // theory: correlation of Hann windows that overlap by half
constexpr double kUncorrelated = 0.05;     // choice: below, a correlation is noise of its own estimate
constexpr std::size_t kShortestShare = 4;  // choice: a correlation over more than 1/4 of a signal is unknown

/// Of real numbers, with half of the lines: the others are their conjugates.
using Transform = Eigen::FFT<double>;

Transform half_transform() {
  return {Transform::impl_type(), Transform::HalfSpectrum};
}

std::vector<double> hann_window(std::size_t length) {
  std::vector<double> window(length);
  for (std::size_t i = 0; i < length; ++i)
    window[i] = 0.5 - 0.5 * std::cos(2 * M_PI * static_cast<double>(i) / static_cast<double>(length));
  return window;
}

std::vector<Complex> windowed_lines(const std::vector<double>& x, std::size_t begin,
                                    const std::vector<double>& window, Transform& transform) {
  const auto first = x.begin() + static_cast<std::ptrdiff_t>(begin);
  std::vector<double> part(first, first + static_cast<std::ptrdiff_t>(window.size()));
  const double mean = std::accumulate(part.begin(), part.end(), 0.0) / static_cast<double>(part.size());
  for (std::size_t i = 0; i < part.size(); ++i) part[i] = (part[i] - mean) * window[i];
  std::vector<Complex> lines;
  transform.fwd(lines, part);
  return lines;
}

void check_welch(std::size_t x, std::size_t y, double interval, std::size_t segment) {
  if (segment < 8 || segment % 2 != 0)
    throw InvalidParameter("segment", static_cast<double>(segment), "must be even and >= 8");
  if (!(interval > 0)) throw InvalidParameter("interval", interval, "must be > 0 s");
  if (x != y) throw InvalidParameter("y", static_cast<double>(y), "must have as many samples as x");
  if (2 * x < 3 * segment)
    throw InvalidParameter("segment", static_cast<double>(segment), "must fit twice, overlapping by half");
}

}  // namespace

std::vector<Complex> fourier_transform(const std::vector<double>& x) {
  std::vector<Complex> lines;
  half_transform().fwd(lines, x);
  return lines;
}

std::vector<double> lagged_products(const std::vector<double>& x, std::size_t lags) {
  if (lags >= x.size())
    throw InvalidParameter("lags", static_cast<double>(lags), "must be below the number of values");
  std::size_t size = 4;
  while (size < x.size() + lags) size *= 2;
  std::vector<double> padded = x;
  padded.resize(size, 0.0);
  Transform transform = half_transform();
  std::vector<Complex> lines;
  transform.fwd(lines, padded);
  for (Complex& line : lines) line = std::norm(line);
  transform.inv(padded, lines, static_cast<Eigen::Index>(size));
  padded.resize(lags + 1);
  return padded;
}

double correlation_length(const std::vector<double>& values) {
  double zero = 0, sum = 1;
  for (const double v : values) zero += v * v;
  if (zero == 0) return 1;
  for (std::size_t lag = 1; lag < values.size() / kShortestShare; ++lag) {
    double product = 0;
    for (std::size_t i = lag; i < values.size(); ++i) product += values[i] * values[i - lag];
    if (product < kUncorrelated * zero) break;
    sum += 2 * product / zero;
  }
  return sum;
}

double WelchSpectra::coherence(std::size_t line) const {
  const double product = xx[line] * yy[line];
  return product > 0 ? std::min(1.0, std::norm(xy[line]) / product) : 0;
}

WelchSpectra welch(const std::vector<double>& x, const std::vector<double>& y, double interval,
                   std::size_t segment) {
  check_welch(x.size(), y.size(), interval, segment);
  const std::vector<double> window = hann_window(segment);
  const std::size_t lines = segment / 2;
  WelchSpectra sum{std::vector<double>(lines, 0.0), std::vector<double>(lines, 0.0),
                   std::vector<Complex>(lines, 0.0), 0};
  Transform transform = half_transform();
  double count = 0;
  for (std::size_t begin = 0; begin + segment <= x.size(); begin += segment / 2, ++count) {
    const auto a = windowed_lines(x, begin, window, transform),
               b = windowed_lines(y, begin, window, transform);
    for (std::size_t k = 0; k < lines; ++k) {
      sum.xx[k] += std::norm(a[k]);
      sum.yy[k] += std::norm(b[k]);
      sum.xy[k] += std::conj(a[k]) * b[k];
    }
  }
  sum.averages = count / (1 + 2 * kOverlap * kOverlap);
  const double power = std::inner_product(window.begin(), window.end(), window.begin(), 0.0);
  const double density = 2 * interval / (power * count);
  for (std::size_t k = 0; k < lines; ++k) {
    sum.xx[k] *= density;
    sum.yy[k] *= density;
    sum.xy[k] *= density;
  }
  return sum;
}

}  // namespace backlash::signal
