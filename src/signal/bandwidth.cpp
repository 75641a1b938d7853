// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/bandwidth.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/measured.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/spectrum.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::signal {
namespace {

constexpr double kShare = 0.99;
constexpr double kAlmostAll = 0.999;        // choice: what is cut off is 3 % of its size
constexpr double kNoiseFrom = 0.35;         // cycles per sample: the upper three tenths
constexpr double kPositionNoiseFrom = 0.1;  // cycles per sample
constexpr double kBand = 0.05;
constexpr double kMeanPerMedian = 1 / M_LN2;  // of a periodogram of noise: exponential distribution
constexpr double kKept = 0.9;                 // choice: share of the third differences that no jump is among
constexpr double kHighest = 0.4;              // cycles per sample
constexpr double kRounding = 1e-12;           // of a number in a file
constexpr double kFewSteps = 10, kOffStep = 0.05, kLeastSteps = 10;  // of a resolution

/// Of second differences, in power.
double gain(double f) {
  return 16 * std::pow(std::sin(M_PI * f), 4);
}

/// Variance per line of the second differences, at (i + 1) / (2 lines) cycles per sample: periodogram with
/// Hann window scaled so that white noise of variance 1 has the mean 1.
std::vector<double> periodogram(const std::vector<double>& values) {
  if (values.size() < 64) throw InvalidParameter("samples", double(values.size()), "must be at least 64");
  const std::vector<double> d = differences(values, 2);
  std::size_t size = 1;
  while (size < d.size()) size *= 2;
  std::vector<double> windowed(size, 0.0);
  double squares = 0;
  for (std::size_t k = 0; k < d.size(); ++k) {
    const double w = 0.5 - 0.5 * std::cos(2 * M_PI * (double(k) + 0.5) / double(d.size()));
    windowed[k] = w * d[k];
    squares += w * w;
  }
  const auto lines = fourier_transform(windowed);
  std::vector<double> power(size / 2);
  for (std::size_t i = 0; i < power.size(); ++i) power[i] = std::norm(lines[i + 1]) / squares;
  return power;
}

double frequency(std::size_t i, const std::vector<double>& power) {
  return 0.5 * double(i + 1) / double(power.size());
}

/// Variance of white noise with the density between two frequencies, from the periodogram of second
/// differences.
double white_variance(const std::vector<double>& power, double from, double to) {
  std::vector<double> density;
  for (std::size_t i = 0; i < power.size(); ++i)
    if (const double f = frequency(i, power); f >= from && f < to) density.push_back(power[i] / gain(f));
  return density.empty() ? 0 : kMeanPerMedian * median(std::move(density));
}

/// From third differences, the largest tenth left out: what moves smoothly, and the few samples where a
/// signal jumps, cancel. A jump is white, so its spectrum looks like that of noise.
double variance_between_jumps(const std::vector<double>& x) {
  std::vector<double> square = differences(x, 3);
  for (double& d : square) d *= d;
  const double largest = quantile(square, kKept);
  const double kept = kKept * double(square.size());
  double sum = 0, below = 0;
  for (const double d : square)
    if (d < largest) sum += d, ++below;
  sum += (kept - below) * largest;  // of those as large as the largest that is kept
  // Mean square of normal values that are not among the largest: E[z^2; z^2 <= q] = P(chi^2_3 <= q).
  static const double share = chi_square_probability(chi_square_quantile(kKept, 1), 3) / kKept;
  return sum / (kept * share * 20);  // 20: variance of third differences of white noise of variance 1
}

/// The largest density in the bands above a tenth of the sampling rate.
double position_variance(const std::vector<double>& power) {
  double largest = 0;
  for (double from = kPositionNoiseFrom; from < 0.49; from += kBand)
    largest = std::max(largest, white_variance(power, from, from + kBand));
  return largest;
}

/// Power of a signal beyond that of its noise, summed up to each line; no further than where it stands out.
struct Standing {
  std::vector<double> up_to;
  std::size_t end;  // line
};

Standing standing(const std::vector<double>& power, const std::vector<double>& noise) {
  const std::size_t n = power.size();
  const auto sum = [](const std::vector<double>& v, std::size_t from, std::size_t to) {
    return std::accumulate(v.begin() + long(from), v.begin() + long(to), 0.0);
  };
  Standing s{std::vector<double>(n + 1, 0.0), 0};
  while (s.end < n) {  // over the next tenth of an octave or eight lines
    const std::size_t next = std::min(n, s.end + std::max<std::size_t>(8, s.end / 10));
    if (sum(power, s.end, next) < 2 * sum(noise, s.end, next)) break;  // half of the power is noise
    for (; s.end < next; ++s.end) s.up_to[s.end + 1] = s.up_to[s.end] + power[s.end] - noise[s.end];
  }
  return s;
}

Standing standing_acceleration(const std::vector<double>& position, double interval) {
  if (!(interval > 0)) throw InvalidParameter("interval", interval, "must be > 0 s");
  const std::vector<double> power = periodogram(position);
  const double white = position_variance(power);
  std::vector<double> noise(power.size());
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = white * gain(frequency(i, power));
  return standing(power, noise);
}

/// Cycles per sample up to where a share of it lies.
double reaches(const Standing& s, double share) {
  std::size_t i = 0;
  while (i < s.end && s.up_to[i] < share * s.up_to[s.end]) ++i;
  return 0.5 * double(i) / double(s.up_to.size() - 1);
}

}  // namespace

double white_noise(const std::vector<double>& values) {
  const double spectral = white_variance(periodogram(values), kNoiseFrom, 1);
  return std::sqrt(std::min(spectral, variance_between_jumps(values)));
}

double position_noise(const std::vector<double>& position) {
  return std::sqrt(position_variance(periodogram(position)));
}

double resolution(const std::vector<double>& position) {
  const auto size = [&](std::size_t k) { return std::fabs(position[k] - position[k - 1]); };
  double largest = 0;
  for (const double x : position) largest = std::max(largest, std::fabs(x));
  const double step = smallest_step(position, kRounding * largest);
  if (step == 0) return 0;
  double travel = 0, steps = 0, odd = 0, all = 0;
  for (std::size_t k = 1; k < position.size(); ++k) {
    if (size(k) > kFewSteps * step || size(k) < 0.5 * step) continue;
    const double whole = std::round(size(k) / step);
    odd += std::fabs(size(k) - whole * step) > kOffStep * step;
    all += 1;
    travel += size(k);
    steps += whole;
  }
  return all >= kLeastSteps && odd < 0.01 * all ? travel / steps : 0;
}

double motion_bandwidth(const std::vector<double>& position, double interval) {
  const Standing acceleration = standing_acceleration(position, interval);
  if (acceleration.end == 0) throw CannotIdentify("no motion stands out of the noise of the position");
  return std::min(kHighest, reaches(acceleration, kShare)) / interval;
}

double torque_bandwidth(const std::vector<double>& torque, const std::vector<double>& position,
                        double interval) {
  const Standing acceleration = standing_acceleration(position, interval);
  std::vector<double> power = periodogram(torque);
  for (std::size_t i = 0; i < power.size(); ++i) power[i] /= gain(frequency(i, power));
  const std::vector<double> noise(power.size(), std::pow(white_noise(torque), 2));
  return std::min(
             {kHighest, reaches(standing(power, noise), kAlmostAll), reaches(acceleration, kAlmostAll)}) /
         interval;
}

double noise_after_low_pass(double interval, double cutoff) {
  const auto half = static_cast<std::size_t>(std::ceil(4 / (cutoff * interval)));
  std::vector<double> impulse(2 * half + 1, 0.0);
  impulse[half] = 1;
  const std::vector<double> response = low_pass(impulse, interval, cutoff);
  return std::sqrt(std::inner_product(response.begin(), response.end(), response.begin(), 0.0));
}

}  // namespace backlash::signal
