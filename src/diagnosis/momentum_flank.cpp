// SPDX-License-Identifier: BSD-3-Clause
#include "momentum_flank.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "refusal.h"

namespace backlash::diagnosis::momentum {
namespace {

constexpr double kLockedTravel = 0.05;  // of the motor's travel
constexpr std::size_t kFewestSamples = 64;
constexpr double kLongestAverage = 0.25;  // of such a cycle, half width
constexpr double kRigidAverage = 32;      // samples, half width, with a rigid coupling
// Of the averaging half width, by which an impact begins later than its averaged torque passes half of its
// peak: exact for an impact much shorter than the averages (closed form); for a longer one between 0 (a step)
// and that, the value from simulated Hunt-Crossley impacts.
constexpr double kLateShort = 0.5, kLateLong = 0.22;

}  // namespace

bool flexible(const MomentumTransferSettings& s) {
  return std::isfinite(s.coupling_stiffness);
}

double inertia_at_flank(const MomentumTransferSettings& s) {
  return flexible(s) ? s.pinion_inertia : s.motor_inertia;
}

double internal_cycle(const MomentumTransferSettings& s) {
  if (!flexible(s)) return 0;
  return 2 * M_PI / std::sqrt(s.coupling_stiffness * (1 / s.motor_inertia + 1 / s.pinion_inertia));
}

std::vector<double> differentiated(const std::vector<double>& x, double interval, std::size_t reach) {
  std::vector<double> rate(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t from = i < reach ? 0 : i - reach, to = std::min(i + reach, x.size() - 1);
    rate[i] = (x[to] - x[from]) / (static_cast<double>(to - from) * interval);
  }
  return rate;
}

std::vector<double> mean_of_held(const std::vector<double>& x, std::size_t reach) {
  std::vector<double> mean(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t from = i < reach ? 0 : i - reach,
                      to = std::max(from + 1, std::min(i + reach, x.size()));
    double sum = 0;
    for (std::size_t k = from; k < to; ++k) sum += x[k];
    mean[i] = sum / static_cast<double>(to - from);
  }
  return mean;
}

/// Mean over one interval to each side of a value that runs straight from sample to sample.
std::vector<double> mean_of_continuous(const std::vector<double>& x) {
  std::vector<double> mean(x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    mean[i] = 0.25 * (x[i > 0 ? i - 1 : 0] + 2 * x[i] + x[std::min(i + 1, x.size() - 1)]);
  return mean;
}

std::vector<double> integrated(const std::vector<double>& x, double interval) {
  std::vector<double> sum(x.size(), 0.0);
  for (std::size_t i = 1; i < x.size(); ++i) sum[i] = sum[i - 1] + 0.5 * interval * (x[i - 1] + x[i]);
  return sum;
}

/// The motor side of a record. What is measured is torque and, by the tachometer, speed, else position.
Motor motor_side(std::vector<double> torque, const std::vector<double>& measured, bool tachometer,
                 double interval) {
  Motor motor;
  motor.interval = interval;
  motor.tachometer = tachometer;
  motor.torque = std::move(torque);
  motor.speed = tachometer ? measured : differentiated(measured, interval);
  motor.position = tachometer ? integrated(measured, interval) : measured;
  return motor;
}

Motor collect(const record::Record& record, const MomentumTransferSettings& settings) {
  const auto refuse = [](const std::string& reason) { throw Refusal{Status::insufficient_data, reason}; };
  const bool torque_measured = record.has(record::Channel::motor_torque);
  const bool tachometer = record.has(record::Channel::motor_velocity);
  if (!tachometer && !record.has(record::Channel::motor_position))
    refuse("the record has neither motor_velocity nor motor_position");
  if (!settings.output_locked && !record.has(record::Channel::load_position))
    refuse("the load is free and the record has no load_position: record it");
  if (record.size() < kFewestSamples)
    refuse("the record has only " + std::to_string(record.size()) + " samples");
  const double interval = record.sampling_interval();
  for (std::size_t i = 1; i < record.size(); ++i)
    if (std::abs(record.time[i] - record.time[i - 1] - interval) > 0.5 * interval)
      throw Refusal{Status::out_of_domain, "the samples are not equidistant"};
  Motor motor = motor_side(
      torque_measured ? record.column(record::Channel::motor_torque)
                      : std::vector<double>(record.size(), 0.0),
      record.column(tachometer ? record::Channel::motor_velocity : record::Channel::motor_position),
      tachometer, interval);
  motor.torque_measured = torque_measured;
  if (settings.output_locked && record.has(record::Channel::load_position)) {
    const auto travel = [](const std::vector<double>& x) { return signal::quantile_range(x, 0.01); };
    const double moved = settings.load_ratio * travel(record.column(record::Channel::load_position));
    if (moved > kLockedTravel * travel(motor.position))
      throw Refusal{
          Status::out_of_domain,
          fmt::format("the output moves by {:.4g} rad although the rig says that it is locked", moved)};
  }
  motor.load.assign(record.size(), 0.0);
  if (!settings.output_locked)
    for (std::size_t i = 0; i < record.size(); ++i)
      motor.load[i] = settings.load_ratio * record.column(record::Channel::load_position)[i];
  for (const auto* column : {&motor.torque, &motor.speed, &motor.position, &motor.load})
    for (const double value : *column)
      if (!std::isfinite(value))
        throw Refusal{Status::insufficient_data, "the record has values that are not finite"};
  return motor;
}

Pinion reconstruct(const Motor& motor, const MomentumTransferSettings& s, std::size_t half) {
  const auto direction = [](double speed) { return speed > 0 ? 1.0 : speed < 0 ? -1.0 : 0.0; };
  Pinion pinion;
  const std::size_t n = motor.speed.size(), reach = std::max<std::size_t>(1, half / 3);
  const std::vector<double> rate = differentiated(motor.speed, motor.interval, reach);
  // The same averages as in the acceleration, or a jump of the torque would leave a pulse.
  std::vector<double> torque = mean_of_held(motor.torque, reach);
  if (!motor.tachometer) torque = mean_of_continuous(torque);
  pinion.torque.resize(n);
  pinion.position.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    pinion.torque[i] = torque[i] - s.motor_damping * motor.speed[i] -
                       s.motor_friction * direction(motor.speed[i]) -
                       (flexible(s) ? s.motor_inertia * rate[i] : 0);
    pinion.position[i] = motor.position[i] - (flexible(s) ? pinion.torque[i] / s.coupling_stiffness : 0);
  }
  return pinion;
}

std::vector<double> flank_torque(const Pinion& pinion, double inertia, double interval, std::size_t half) {
  const std::size_t n = pinion.torque.size();
  const double h = static_cast<double>(half), span = h * interval;
  std::vector<double> flank(n, 0.0);
  for (std::size_t i = half; i + half < n; ++i) {
    double mean = 0;
    for (std::size_t k = i - half + 1; k < i + half; ++k)
      mean += (h - std::abs(static_cast<double>(k) - static_cast<double>(i))) / (h * h) * pinion.torque[k];
    flank[i] = mean - inertia *
                          (pinion.position[i + half] - 2 * pinion.position[i] + pinion.position[i - half]) /
                          (span * span);
  }
  return flank;
}

double at(const std::vector<double>& x, double index) {
  const double clamped = std::clamp(index, 0.0, static_cast<double>(x.size() - 2));
  const auto i = static_cast<std::size_t>(clamped);
  return x[i] + (clamped - static_cast<double>(i)) * (x[i + 1] - x[i]);
}

/// Where side * x passes `level` upwards between samples i - 1 and i.
double passage(const std::vector<double>& x, int side, double level, std::size_t i) {
  const double before = side * x[i - 1], after = side * x[i];
  return static_cast<double>(i) - (after > before ? (after - level) / (after - before) : 0);
}

double shortness_of_impacts(const Flank& flank, double interval, const MomentumTransferSettings& s) {
  if (!s.flank_deflection) return 1;
  const double averaging_time = static_cast<double>(flank.half) * interval;
  const double compliance = std::max(0.0, s.flank_deflection(flank.level) / flank.level);
  return std::max(0.0, 1 - M_PI * std::sqrt(inertia_at_flank(s) * compliance) / averaging_time);
}

/// The impact whose averaged torque rises above the level at sample i: where it passes half of its first
/// peak, and somewhat later, since averages rise early.
Crossing impact_at(const std::vector<double>& flank, int side, std::size_t i, std::size_t half,
                   double shortness) {
  std::size_t top = i, up = i;
  while (top + 1 < flank.size() && side * flank[top + 1] > side * flank[top]) ++top;
  const double edge = 0.5 * side * flank[top], late = kLateLong + shortness * (kLateShort - kLateLong);
  while (up > 1 && side * flank[up - 1] > edge) --up;
  while (side * flank[up] < edge) ++up;
  return {side, 0, passage(flank, side, edge, up) + late * static_cast<double>(half), edge * (1 - shortness)};
}

std::vector<Crossing> find_crossings(const Flank& of, double shortness) {
  const std::vector<double>& flank = of.torque;
  const double level = of.level;
  const std::size_t half = of.half;
  std::vector<Crossing> crossings;
  int side = 0;  // flank touched last
  double release = 0;
  for (std::size_t i = half + 1; i + 3 * half < flank.size(); ++i) {
    if (side != 0 && side * flank[i - 1] > 0.5 * level && side * flank[i] <= 0.5 * level)
      release = passage(flank, -side, -0.5 * level, i);
    const int now = flank[i] > level ? 1 : flank[i] < -level ? -1 : 0;
    if (now == 0 || now == side) continue;
    if (side != 0 && release > 0) {
      crossings.push_back(impact_at(flank, now, i, half, shortness));
      crossings.back().release = release;
    }
    side = now;
    release = 0;
  }
  return crossings;
}

double noise_gain(bool of_torque, bool tachometer, double interval, std::size_t half,
                  const MomentumTransferSettings& s) {
  const std::size_t n = 4 * half + 16;
  std::vector<double> pulse(n, 0.0), none(n, 0.0);
  pulse[n / 2] = 1;
  const Motor motor = motor_side(of_torque ? pulse : none, of_torque ? none : pulse, tachometer, interval);
  double squares = 0;
  for (const double f : flank_torque(reconstruct(motor, s, half), inertia_at_flank(s), interval, half))
    squares += f * f;
  return std::sqrt(squares);
}

double longest_average(const MomentumTransferSettings& s, double interval) {
  return flexible(s) ? std::max(2.0, kLongestAverage * internal_cycle(s) / interval) : kRigidAverage;
}

double motion_noise(const Motor& motor) {
  const std::vector<double>& measured = motor.tachometer ? motor.speed : motor.position;
  return std::max(signal::noise_from_differences(measured, 4),
                  signal::smallest_step(measured) / std::sqrt(12.0));
}

Flank calm_flank(const Motor& motor, const MomentumTransferSettings& s) {
  const double dt = motor.interval;
  const double longest = longest_average(s, dt);
  const double torque = signal::noise_from_differences(motor.torque, 4);
  const double motion = motion_noise(motor);
  Flank flank;
  for (flank.half = 2; static_cast<double>(flank.half) <= longest; ++flank.half) {
    flank.pinion = reconstruct(motor, s, flank.half);
    flank.torque = flank_torque(flank.pinion, inertia_at_flank(s), dt, flank.half);
    std::vector<double> sizes;
    for (const double f : flank.torque) sizes.push_back(std::abs(f));
    flank.level = signal::median(std::move(sizes));
    flank.noise = std::hypot(torque * noise_gain(true, motor.tachometer, dt, flank.half, s),
                             motion * noise_gain(false, motor.tachometer, dt, flank.half, s));
    if (kNoiseFree * flank.noise < 0.5 * flank.level) return flank;
  }
  throw Refusal{Status::out_of_domain,
                fmt::format("impacts cannot be distinguished from noise: the torque on the "
                            "flank, {:.4g} N m in the median, has noise of {:.4g} N m",
                            flank.level, flank.noise)};
}

}  // namespace backlash::diagnosis::momentum
