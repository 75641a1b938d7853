// SPDX-License-Identifier: BSD-3-Clause
#include "encoder_motion.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

constexpr double kThrown = 0.1;  // of the rms speed, thrown within a sample: choice
constexpr std::size_t kFewestSamples = 64, kThrows = 4;

}  // namespace

MotorTorque torque_at_flanks(const record::Record& record, const PositionDifferenceSettings& settings) {
  using record::Channel;
  for (const Channel channel : {Channel::motor_torque, Channel::sensor_torque})
    if (record.has(channel)) return {record.column(channel), 1};
  if (!record.has(Channel::output_torque))
    throw Refusal{Status::insufficient_data,
                  "the record has no motor_torque, sensor_torque or output_torque to distinguish the flanks: "
                  "record one of them"};
  const double sign = settings.output_torque_reversed ? -1 : 1;
  return {record.column(Channel::output_torque), sign / settings.load_ratio, true};
}

TwoEncoders two_encoders(const record::Record& record, const PositionDifferenceSettings& settings) {
  using record::Channel;
  for (const Channel channel : {Channel::motor_position, Channel::load_position})
    if (!record.has(channel))
      throw Refusal{Status::insufficient_data, "the record has no " + record::channel_name(channel)};
  const MotorTorque source = torque_at_flanks(record, settings);
  record::Record whole;
  whole.unsure_time = record.unsure_time;
  auto &motor = whole.column(Channel::motor_position), &load = whole.column(Channel::load_position),
       &torque = whole.column(Channel::motor_torque);
  for (std::size_t i = 0; i < record.size(); ++i) {
    const double values[] = {source.values[i], record.column(Channel::motor_position)[i],
                             record.column(Channel::load_position)[i]};
    if (!std::all_of(std::begin(values), std::end(values), [](double v) { return std::isfinite(v); }))
      continue;
    whole.time.push_back(record.time[i]);
    torque.push_back(source.factor * values[0]);
    motor.push_back(values[1]), load.push_back(settings.load_ratio * values[2]);
  }
  if (whole.size() < kFewestSamples)
    throw Refusal{Status::insufficient_data,
                  "the record has only " + std::to_string(whole.size()) + " usable samples"};
  const record::EvenGrid even = record::even_grid(whole);
  TwoEncoders motion;
  motion.interval = even.record.sampling_interval();
  motion.torque = even.record.column(Channel::motor_torque);
  motion.motor = even.record.column(Channel::motor_position);
  motion.load = even.record.column(Channel::load_position);
  for (std::size_t i = 0; i < even.record.size(); ++i) motion.recorded.push_back(!even.lost[i]);
  return motion;
}

double travelled(const std::vector<double>& values) {
  return signal::quantile_range(values, 0.01);
}

TwoEncoders without_skew(TwoEncoders motion, double skew) {
  if (skew == 0) return motion;
  const double samples = skew / motion.interval;
  motion.load = signal::delayed(motion.load, -samples);
  const long reach = std::lround(std::ceil(std::abs(samples))) + 2, n = long(motion.motor.size());
  const std::vector<char> before = motion.recorded;
  for (long i = 0; i < n; ++i) {
    if (before[i] && i >= reach && i < n - reach) continue;
    for (long k = std::max(0L, i - reach); k <= std::min(n - 1, i + reach); ++k) motion.recorded[k] = false;
  }
  return motion;
}

bool load_travels(const TwoEncoders& motion) {
  std::vector<double> deflection(motion.motor.size());
  for (std::size_t i = 0; i < deflection.size(); ++i) deflection[i] = motion.motor[i] - motion.load[i];
  const double moved = travelled(motion.load);
  return moved > 0.5 * travelled(deflection) && moved > 20 * signal::smallest_step(motion.load);
}

void require_possible(const TwoEncoders& motion, double inertia) {
  constexpr double kSurelyTooFast = 3;
  constexpr std::size_t kOutliers = 6;
  if (!(inertia > 0)) return;
  double torque = 0;
  for (const double t : {signal::quantile(motion.torque, 0.01), signal::quantile(motion.torque, 0.99)})
    torque = std::max(torque, std::abs(t));
  const double moved = travelled(motion.motor);
  const double fastest = kSurelyTooFast * std::sqrt(2 * torque * moved / inertia);
  const auto lag = static_cast<std::size_t>(std::min(1e6, 0.5 * moved / (fastest * motion.interval)));
  if (lag < 1 || !(fastest > 0)) return;
  std::size_t jumps = 0;
  for (std::size_t i = 0; i + lag < motion.motor.size(); ++i)
    jumps += std::abs(motion.motor[i + lag] - motion.motor[i]) > 0.5 * moved;
  if (jumps > kOutliers)
    throw Refusal{Status::out_of_domain,
                  fmt::format("motor_position jumps faster than a torque of {:.4g} N m can drive the motor: "
                              "columns are exchanged, or a unit is not as declared",
                              torque)};
}

void require_steady(const TwoEncoders& motion, double inertia) {
  if (!(inertia > 0)) return;
  const std::size_t n = motion.motor.size(), lag = kThrows;
  double alternates = 0, squares = 0;
  for (std::size_t i = 1; i + 1 < n; ++i)
    alternates += 0.25 * std::abs(motion.torque[i - 1] - 2 * motion.torque[i] + motion.torque[i + 1]);
  for (std::size_t i = lag; i < n; ++i) squares += std::pow(motion.motor[i] - motion.motor[i - lag], 2);
  const double speed = std::sqrt(squares / double(n - lag)) / (double(lag) * motion.interval);
  const double thrown = alternates / double(n - 2) * motion.interval / inertia;
  if (thrown > kThrown * speed)
    throw Refusal{Status::out_of_domain,
                  fmt::format("the torque alternates from sample to sample, which throws the motor by {:.3g} "
                              "rad/s within them, where it moves at {:.3g} rad/s: a drive that chatters, or "
                              "a torque that is mostly noise",
                              thrown, speed)};
}

}  // namespace backlash::diagnosis
