// SPDX-License-Identifier: BSD-3-Clause
#include "encoder_motion.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/encoder_skew.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

constexpr double kThrown = 0.1;  // of the rms speed, thrown within a sample: choice
constexpr double kBroken = 1.5;  // intervals between samples, beyond which they are no neighbours

}  // namespace

FlankTorque torque_at_flanks(const record::Record& record, const PositionDifferenceSettings& settings) {
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
  for (const record::Channel channel : {record::Channel::motor_position, record::Channel::load_position})
    if (!record.has(channel))
      throw Refusal{Status::insufficient_data, "the record has no " + record::channel_name(channel)};
  const FlankTorque source = torque_at_flanks(record, settings);
  const std::vector<double>& torque = source.values;
  const auto &q_motor = record.column(record::Channel::motor_position),
             &q_load = record.column(record::Channel::load_position);
  TwoEncoders motion;
  motion.interval = record.sampling_interval();
  double last = -INFINITY;
  for (std::size_t i = 0; i < record.size(); ++i) {
    if (!std::isfinite(torque[i]) || !std::isfinite(q_motor[i]) || !std::isfinite(q_load[i])) continue;
    motion.unbroken.push_back(record.time[i] - last < kBroken * motion.interval);
    last = record.time[i];
    motion.torque.push_back(source.factor * torque[i]);
    motion.motor.push_back(q_motor[i]);
    motion.load.push_back(settings.load_ratio * q_load[i]);
  }
  if (motion.motor.size() < 16 * kShortestWindow)
    throw Refusal{Status::insufficient_data,
                  "the record has only " + std::to_string(motion.motor.size()) + " usable samples"};
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
  std::vector<char> unbroken = motion.unbroken;
  for (long i = 0; i < n; ++i) {
    if (motion.unbroken[i] && i >= reach && i < n - reach) continue;
    for (long k = std::max(0L, i - reach); k <= std::min(n - 1, i + reach); ++k) unbroken[k] = false;
  }
  motion.unbroken = std::move(unbroken);
  return motion;
}

signal::Measured clear_skew(const TwoEncoders& motion, double inertia) {
  try {
    const signal::Measured skew =
        record::encoder_skew({motion.interval, motion.torque, motion.motor, motion.load, inertia});
    if (record::is_clear(skew)) return skew;
  } catch (const CannotIdentify&) {  // too short, or too little moves
  }
  return {0, 0};
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
  const std::size_t n = motion.motor.size(), lag = kShortestWindow;
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
