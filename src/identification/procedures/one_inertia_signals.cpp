// SPDX-License-Identifier: BSD-3-Clause
#include "one_inertia_signals.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr double kLeastPeriods = 40;  // choice: of the cutoff
constexpr double kPeriods = 100;      // choice: where the cutoff is chosen
constexpr double kStanding = 4;       // choice: standard deviations of the speed's noise
constexpr double kSignNoise = 1e-3;   // choice: of the speed: how sharply its sign is taken
constexpr double kShowing = 0.05;     // choice: of the speed: noise that hides its sign (kStanding) only near
                                      // standstill
constexpr double kSignBandwidth = 4;  // choice: but not below four times the cutoff
constexpr double kReach = 0.3;        // theory: periods of its cutoff that the speed is sharp to
constexpr std::size_t kSeen = 2;      // theory: samples to either side

std::vector<double> second_derivative(const std::vector<double>& x, double interval) {
  const std::size_t n = x.size();
  std::vector<double> a(n);
  for (std::size_t k = 1; k + 1 < n; ++k) a[k] = (x[k + 1] - 2 * x[k] + x[k - 1]) / (interval * interval);
  a[0] = a[1];
  a[n - 1] = a[n - 2];
  return a;
}

/// A second difference is the mean of the acceleration over two intervals with triangular weights. This is
/// that mean of what is smooth, by Simpson's rule.
std::vector<double> over_second_difference(const std::vector<double>& x) {
  std::vector<double> mean = x;
  for (std::size_t k = 1; k + 1 < x.size(); ++k) mean[k] = (x[k - 1] + 10 * x[k] + x[k + 1]) / 12;
  return mean;
}

/// 1 where the motor moves one way over all that a sample's equation sees, `reach` samples to either side; 0
/// where it may stand or turn, and friction take any value.
std::vector<double> sliding(const std::vector<double>& speed, double threshold, long reach) {
  const long n = long(speed.size());
  std::vector<int> direction(n);
  for (long k = 0; k < n; ++k) direction[k] = (speed[k] > threshold) - (speed[k] < -threshold);
  std::vector<double> slides(n, 1.0);
  for (long k = 0; k < n; ++k)
    for (long j = std::max(0L, k - reach); j <= std::min(n - 1, k + reach); ++j)
      if (direction[j] == 0 || direction[j] != direction[k]) slides[k] = 0;
  return slides;
}

/// White noise of the position, differentiated up to a cutoff: the square of 2 pi f integrated.
double speed_noise(double position_noise, double cutoff, double interval) {
  return position_noise * 2 * M_PI * cutoff * std::sqrt(2 * cutoff * interval / 3);
}

/// Cutoff [Hz] at which the noise of the speed is that share of the speed.
double speed_bandwidth(double position_noise, const std::vector<double>& speed, double interval,
                       double share) {
  const double size = Eigen::Map<const Eigen::VectorXd>(speed.data(), Eigen::Index(speed.size())).norm() /
                      std::sqrt(double(speed.size()));
  return std::pow(share * size / speed_noise(position_noise, 1, interval), 2.0 / 3);
}

/// Of the position, as a second difference of the torque sees it.
std::vector<double> weight_column(const std::vector<double>& position, double phase) {
  std::vector<double> out;
  for (const double q : position) out.push_back(std::sin(q + phase));
  return over_second_difference(out);
}

}  // namespace

void require_torque_and_position(const record::Record& record) {
  if (!record.has(record::Channel::motor_torque) || !record.has(record::Channel::motor_position))
    throw CannotIdentify(record.name + ": a machine with one inertia needs motor_torque and motor_position");
  if (record.size() < 64)
    throw CannotIdentify(record.name + ": only " + std::to_string(record.size()) + " samples");
}

record::EvenGrid grid_with_losses(const record::Record& recorded, const std::vector<bool>& lost) {
  record::EvenGrid grid = record::evenly_sampled_grid(recorded);
  if (lost.size() == grid.lost.size()) grid.lost = lost;
  return grid;
}

OneInertiaSignals one_inertia_signals(const record::EvenGrid& grid, double cutoff, bool gravity,
                                      double smoothed) {
  const record::Record& record = grid.record;
  OneInertiaSignals s;
  const std::vector<double>& recorded = record.column(record::Channel::motor_position);
  const std::size_t n = record.size();
  const double t = s.interval = record.sampling_interval();
  const auto smooth = [&](std::vector<double> x) {
    return smoothed > 0 && smoothed < 0.4 / t ? signal::low_pass(x, t, smoothed) : x;
  };
  const std::vector<double> position = smooth(recorded);
  if (cutoff != 0 && !(cutoff > 0 && cutoff <= 0.4 / t))
    throw InvalidParameter("cutoff", cutoff, "must be > 0 and at most 0.4 of the sampling rate");
  s.cutoff =
      cutoff > 0 ? cutoff : std::max(signal::motion_bandwidth(recorded, t), kPeriods / (double(n) * t));
  if (double(n) * t * s.cutoff < (cutoff > 0 ? kFewestPeriods : kLeastPeriods))
    throw CannotIdentify(fmt::format("{}: {:.3g} s are too short for a motion of {:.3g} Hz", record.name,
                                     double(n) * t, s.cutoff));
  // What shakes above the band is no noise: only what no band holds is.
  s.position_noise = smoothed > 0 ? signal::white_noise(recorded) : signal::position_noise(recorded);
  // The rounding of a slow motion is no white noise, and more than what looks like it.
  s.position_error = std::max(s.position_noise, signal::resolution(recorded) / std::sqrt(12.0));
  s.time = record.time;
  s.torque = over_second_difference(smooth(record.column(record::Channel::motor_torque)));
  const std::vector<double> speed = signal::derivative(position, t);
  // Sharper than the noise of the speed allows nothing would be seen to slide.
  const double sharpest = std::max(s.cutoff, speed_bandwidth(s.position_noise, speed, t, kShowing));
  const double sharp_cutoff = std::min(std::clamp(speed_bandwidth(s.position_noise, speed, t, kSignNoise),
                                                  std::min(kSignBandwidth * s.cutoff, 0.4 / t), 0.4 / t),
                                       sharpest);
  const std::vector<double> sharp = signal::low_pass(speed, t, sharp_cutoff);
  std::vector<double> sign(n);
  for (std::size_t k = 0; k < n; ++k) sign[k] = (sharp[k] > 0) - (sharp[k] < 0);
  const double threshold = kStanding * speed_noise(s.position_noise, sharp_cutoff, t);
  s.slides = sliding(sharp, threshold, 1 + std::lround(kReach / (sharp_cutoff * t)));
  for (std::size_t k = 0; k < n; ++k)  // as far as a second difference of a difference sees
    for (std::size_t j = k < kSeen ? 0 : k - kSeen; j <= std::min(n - 1, k + kSeen); ++j)
      if (grid.lost[j]) s.slides[k] = 0;
  std::vector<std::vector<double>> columns = {second_derivative(position, t), over_second_difference(speed),
                                              sign, std::vector<double>(n, 1)};
  if (gravity)
    for (const double phase : {0.0, M_PI_2}) columns.push_back(weight_column(position, phase));
  s.columns.resize(Eigen::Index(n), Eigen::Index(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::vector<double> filtered = low_pass_sliding(s, columns[i]);
    s.columns.col(Eigen::Index(i)) = Eigen::Map<const Eigen::VectorXd>(filtered.data(), Eigen::Index(n));
  }
  const auto end = static_cast<std::size_t>(std::ceil(1 / (s.cutoff * t)));
  for (std::size_t k = end; k + end < n; ++k)
    if (s.slides[k] != 0) s.used.push_back(Eigen::Index(k));
  return s;
}

std::vector<double> low_pass_sliding(const OneInertiaSignals& s, std::vector<double> x) {
  for (std::size_t k = 0; k < x.size(); ++k) x[k] *= s.slides[k];
  return signal::low_pass(x, s.interval, s.cutoff);
}

}  // namespace backlash::identification
