// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/fit/servo_data.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/mesh_resonance.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/measured.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "backlash_diagnosis/simulation/driven_load.h"

namespace backlash::identification {
namespace {

constexpr std::size_t kStart = 10;  // samples, choice: of the line that the load's start is taken from
constexpr std::size_t kLeastForNoise = 64;  // samples, theory: for the noise of a position (bandwidth.h)
constexpr double kRateNoise =
    0.95;  // theory: of a five-point difference of white noise of deviation 1, per sample
constexpr double kClear = 0.02;  // choice: of the speed: noise that does not hide its direction
constexpr double kSureSpeed =
    5;  // choice: standard deviations of the speed's noise, from which it has a sign
constexpr double kWidestBand = 0.2;   // theory: of the sampling rate, up to which differences are derivatives
constexpr double kReach = 0.3;        // theory: periods of its band that a smooth speed is sharp to
constexpr double kNarrower = 0.9;     // choice: from one band that is tried to the next
constexpr double kLeastPeriods = 10;  // choice: of the band, in the record: below, nothing is smoothed
constexpr double kLoadRateBand = 120 / model::kTriedResonance;  // simulation: in units of the mesh resonance

std::vector<double> scaled(const record::Record& record, record::Channel channel, double factor) {
  std::vector<double> values = record.column(channel);
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!std::isfinite(values[k]))
      throw BadData(record.name, record::channel_name(channel) +
                                     " is not a number at t = " + record::time_text(record.time[k]) + " s");
    values[k] *= factor;
  }
  return values;
}

/// Five points: at a tenth of the sampling rate the central difference already loses 6 %, this one 0.5 %.
std::vector<double> fast_derivative(const std::vector<double>& x, double interval) {
  std::vector<double> rate = signal::derivative(x, interval);
  for (std::size_t k = 2; k + 2 < x.size(); ++k)
    rate[k] = (x[k - 2] - 8 * x[k - 1] + 8 * x[k + 1] - x[k + 2]) / (12 * interval);
  return rate;
}

std::vector<double> second_difference(const std::vector<double>& x, double interval) {
  std::vector<double> a(x.size());
  for (std::size_t k = 1; k + 1 < x.size(); ++k)
    a[k] = (x[k + 1] - 2 * x[k] + x[k - 1]) / (interval * interval);
  a.front() = a[1];
  a.back() = a[a.size() - 2];
  return a;
}

/// Value and slope per sample at the first sample, by a straight line: a filter does not smooth at its ends.
std::pair<double, double> start_of(const std::vector<double>& x) {
  const std::size_t n = std::min(kStart, x.size());
  const double middle = 0.5 * double(n - 1);
  double mean = 0, moment = 0, square = 0;
  for (std::size_t k = 0; k < n; ++k) {
    mean += x[k] / double(n);
    moment += (double(k) - middle) * x[k];
    square += (double(k) - middle) * (double(k) - middle);
  }
  return {mean - middle * moment / square, moment / square};
}

void take_rates_of_load(ServoData& data) {
  data.load_rate =
      signal::low_pass(fast_derivative(data.load, data.interval), data.interval, data.load_rate_cutoff);
  std::tie(data.first_load, data.first_load_rate) = start_of(data.load);
  data.first_load_rate /= data.interval;
}

double root_mean_square(const std::vector<double>& x) {
  double square = 0;
  for (const double v : x) square += v * v;
  return std::sqrt(square / double(x.size()));
}

/// Standard deviation of the derivative of white noise of deviation 1 after a low-pass: 2 pi f integrated up
/// to the cutoff.
double rate_of_noise(double cutoff, double interval) {
  return 2 * M_PI * cutoff * std::sqrt(2 * cutoff * interval / 3);
}

/// The same of the second derivative: (2 pi f)^2 integrated up to the cutoff.
double acceleration_of_noise(double cutoff, double interval) {
  return std::pow(2 * M_PI * cutoff, 2) * std::sqrt(2 * cutoff * interval / 5);
}

/// In the widest band in which noise does not hide it, or the narrowest that is tried.
std::vector<double> smooth_acceleration(const ServoData& data, double position_noise) {
  const double narrowest = kLeastPeriods / (double(data.size()) * data.interval);
  std::vector<double> smooth = data.motor_acceleration;
  for (double band = kWidestBand / data.interval; band > narrowest; band *= kNarrower) {
    smooth = signal::low_pass(data.motor_acceleration, data.interval, band);
    if (position_noise * acceleration_of_noise(band, data.interval) <= kClear * root_mean_square(smooth))
      break;
  }
  return smooth;
}

/// Repeats with narrower bands: where the machine stands most of the time, the root mean square of the rate
/// is mostly noise.
void smooth_slow_motion(ServoData& data) {
  if (data.rate_noise <= kClear * root_mean_square(data.motor_rate)) return;
  const double position = data.rate_noise * data.interval / kRateNoise;
  const double narrowest = kLeastPeriods / (double(data.size()) * data.interval);
  for (double band = kWidestBand / data.interval; band > narrowest; band *= kNarrower) {
    const std::vector<double> smooth = signal::low_pass(data.motor, data.interval, band);
    const std::vector<double> rate = fast_derivative(smooth, data.interval);
    const double noise = position * rate_of_noise(band, data.interval);
    if (noise > kClear * root_mean_square(rate)) continue;
    data.recorded_motor = std::move(data.motor);
    data.motor = smooth;
    data.motor_rate = rate;
    data.rate_noise = noise;
    data.smooth_reach = std::lround(kReach / (band * data.interval));
    return;
  }
}

}  // namespace

double time_between_reversals(const ServoData& data) {
  const double sure = kSureSpeed * data.rate_noise;
  int direction = 0, reversals = 0;
  for (const double rate : data.motor_rate) {
    if (std::fabs(rate) <= sure) continue;
    const int now = rate > 0 ? 1 : -1;
    reversals += direction == -now;
    direction = now;
  }
  return double(data.size()) * data.interval / (reversals + 1);
}

record::Record load_side(const record::Record& record, const model::Rig& rig) {
  record::Record out = record;
  const double ratio = rig.motor_axis_ratio();
  for (const record::Channel channel : {record::Channel::motor_torque, record::Channel::sensor_torque})
    for (double& value : out.column(channel)) value *= ratio;
  for (const record::Channel channel : {record::Channel::motor_position, record::Channel::motor_velocity,
                                        record::Channel::reference_position})
    for (double& value : out.column(channel)) value /= ratio;
  return out;
}

ServoData servo_data(const record::Record& raw, const model::Rig& rig, double torque) {
  return servo_data(record::evenly_sampled_grid(raw), rig, torque);
}

ServoData servo_data(const record::EvenGrid& grid, const model::Rig& rig, double torque) {
  const record::Record& record = grid.record;
  for (const record::Channel channel : {record::Channel::motor_torque, record::Channel::motor_position})
    if (!record.has(channel)) throw CannotIdentify(record.name + " has no " + record::channel_name(channel));
  const double ratio = rig.motor_axis_ratio();
  ServoData data;
  data.lost = grid.lost;
  data.interval = record.sampling_interval();
  data.start = record.start();
  data.torque = scaled(record, record::Channel::motor_torque, ratio);
  data.motor = scaled(record, record::Channel::motor_position, 1 / ratio);
  data.motor_rate = fast_derivative(data.motor, data.interval);
  const double noise = data.size() >= kLeastForNoise ? signal::position_noise(data.motor) : 0;
  data.rate_noise = kRateNoise * noise / data.interval;
  if (!simulation::load_moves_freely(rig)) {
    const double rounding = signal::resolution(data.motor) / std::sqrt(12.0);  // of a slow motion not white
    data.rate_noise = std::max(data.rate_noise, kRateNoise * rounding / data.interval);
    smooth_slow_motion(data);
  }
  data.motor_acceleration = second_difference(data.motor, data.interval);
  if (rig.mesh.rigid) data.smooth_acceleration = smooth_acceleration(data, noise);
  if (!record.has(record::Channel::load_position)) return data;
  data.load = scaled(record, record::Channel::load_position, 1);
  const double highest = kWidestBand / data.interval;
  const double resonance =
      simulation::load_moves_freely(rig)
          ? mesh_resonance(model::load_side(rig), torque > 0 ? torque : model::usual_torque(data.torque))
          : 0;
  data.load_rate_cutoff = resonance > 0 ? std::min(kLoadRateBand * resonance, highest) : highest;
  take_rates_of_load(data);
  return data;
}

void press_as_recorded(ServoData& data) {
  if (data.recorded_motor.empty()) return;
  data.teeth_recorded = true;
  data.rate_reach += data.smooth_reach;
  data.motor_acceleration = second_difference(data.recorded_motor, data.interval);
}

ServoData with_columns(const ServoData& pattern, std::vector<double> torque, std::vector<double> motor,
                       std::vector<double> load) {
  ServoData data = pattern;
  data.torque = std::move(torque);
  data.motor = std::move(motor);
  data.load = std::move(load);
  data.motor_rate = fast_derivative(data.motor, data.interval);
  data.motor_acceleration = second_difference(data.motor, data.interval);
  take_rates_of_load(data);
  return data;
}

}  // namespace backlash::identification
