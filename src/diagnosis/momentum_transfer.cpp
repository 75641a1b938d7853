// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/momentum_transfer.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

constexpr double kLockedTravel = 0.05;  // of the motor's travel
constexpr std::size_t kFewestSamples = 64;
constexpr std::size_t kFewestCrossings = 4;
constexpr double kSamplesPerCycle = 10;   // of motor against pinion
constexpr double kLongestAverage = 0.25;  // of such a cycle, half width
constexpr double kRigidAverage = 32;      // samples, half width, with a rigid coupling
constexpr double kNoiseFree = 5;          // standard deviations of F below half of its median
constexpr double kFlight = 0.3;           // torque left in flight over that in contact, at most
constexpr double kTiming = 0.5;           // samples, when the impact began
// Of the averaging half width, by which an impact begins later than its averaged torque passes half of its
// peak: exact for an impact much shorter than the averages (closed form); for a longer one between 0 (a step)
// and that, the value from simulated Hunt-Crossley impacts.
constexpr double kLateShort = 0.5, kLateLong = 0.22;
constexpr double kElasticShare = 0.14;  // of the elastic deflections in the interval

void require(bool valid, const char* name, double value, const char* limit) {
  if (!valid) throw InvalidParameter(std::string("momentum_transfer.") + name, value, limit);
}

bool flexible(const MomentumTransferSettings& s) {
  return std::isfinite(s.coupling_stiffness);
}

void check(const MomentumTransferSettings& s) {
  require(s.motor_inertia > 0 && std::isfinite(s.motor_inertia), "motor_inertia", s.motor_inertia,
          "must be > 0");
  require(s.motor_damping >= 0 && std::isfinite(s.motor_damping), "motor_damping", s.motor_damping,
          "must be >= 0");
  require(s.pinion_inertia >= 0 && std::isfinite(s.pinion_inertia), "pinion_inertia", s.pinion_inertia,
          "must be >= 0");
  require(s.coupling_stiffness > 0, "coupling_stiffness", s.coupling_stiffness, "must be > 0");
  require(!flexible(s) || s.pinion_inertia > 0, "pinion_inertia", s.pinion_inertia,
          "must be > 0 beyond a flexible coupling");
  require(s.load_ratio > 0 && std::isfinite(s.load_ratio), "load_ratio", s.load_ratio, "must be > 0");
  require(!(s.base_radius <= 0), "base_radius", s.base_radius, "must be > 0");
}

double inertia_at_flank(const MomentumTransferSettings& s) {
  return flexible(s) ? s.pinion_inertia : s.motor_inertia;
}

/// Cycle [s] of motor against pinion, both free; 0 for a rigid coupling.
double internal_cycle(const MomentumTransferSettings& s) {
  if (!flexible(s)) return 0;
  return 2 * M_PI / std::sqrt(s.coupling_stiffness * (1 / s.motor_inertia + 1 / s.pinion_inertia));
}

/// Motion of the motor side, sample by sample.
struct Motor {
  double interval = 0;                          // s
  bool tachometer = false;                      // speed is measured, position its integral; else the reverse
  std::vector<double> torque, speed, position;  // N m, rad/s, rad
  std::vector<double> load;                     // rad at the motor axis
};

/// Central differences over `reach` samples to each side, fewer at the ends.
std::vector<double> differentiated(const std::vector<double>& x, double interval, std::size_t reach = 1) {
  std::vector<double> rate(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::size_t from = i < reach ? 0 : i - reach, to = std::min(i + reach, x.size() - 1);
    rate[i] = (x[to] - x[from]) / (static_cast<double>(to - from) * interval);
  }
  return rate;
}

/// Mean over `reach` intervals to each side of a value that is held from its sample to the next.
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
  if (!record.has(record::Channel::motor_torque)) refuse("the record has no motor_torque");
  const bool tachometer = record.has(record::Channel::motor_velocity);
  if (!tachometer && !record.has(record::Channel::motor_position))
    refuse("the record has neither motor_velocity nor motor_position");
  if (!settings.output_locked && !record.has(record::Channel::load_position))
    refuse("the load is free and the record has no load_position");
  if (record.size() < kFewestSamples)
    refuse("the record has only " + std::to_string(record.size()) + " samples");
  const double interval = record.sampling_interval();
  for (std::size_t i = 1; i < record.size(); ++i)
    if (std::abs(record.time[i] - record.time[i - 1] - interval) > 0.5 * interval)
      throw Refusal{Status::out_of_domain, "the samples are not equidistant"};
  Motor motor = motor_side(
      record.column(record::Channel::motor_torque),
      record.column(tachometer ? record::Channel::motor_velocity : record::Channel::motor_position),
      tachometer, interval);
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

/// Torque that the motor transmits [N m], and the resulting position of the pinion [rad].
struct Pinion {
  std::vector<double> torque, position;
};

Pinion reconstruct(const Motor& motor, const MomentumTransferSettings& s, std::size_t half) {
  Pinion pinion;
  const std::size_t n = motor.speed.size(), reach = std::max<std::size_t>(1, half / 3);
  const std::vector<double> rate = differentiated(motor.speed, motor.interval, reach);
  // The same averages as in the acceleration, or a jump of the torque would leave a pulse.
  std::vector<double> torque = mean_of_held(motor.torque, reach);
  if (!motor.tachometer) torque = mean_of_continuous(torque);
  pinion.torque.resize(n);
  pinion.position.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    pinion.torque[i] =
        torque[i] - s.motor_damping * motor.speed[i] - (flexible(s) ? s.motor_inertia * rate[i] : 0);
    pinion.position[i] = motor.position[i] - (flexible(s) ? pinion.torque[i] / s.coupling_stiffness : 0);
  }
  return pinion;
}

/// F, averaged over `half` samples to each side; 0 at the ends.
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

struct Crossing {
  int side = 1;                    // flank that is hit
  double release = 0, impact = 0;  // sample
  double impact_torque = 0;        // N m, F at `impact`
};

/// Share of the averaging time that an impact leaves over; 1 on a rigid flank. It lasts half a cycle of what
/// is stopped on the flank, whose stiffness is that at its resting torque.
double shortness_of_impacts(double level, double averaging_time, const MomentumTransferSettings& s) {
  if (!s.flank_deflection) return 1;
  const double compliance = std::max(0.0, s.flank_deflection(level) / level);
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

/// Crossings from flank to flank: |F| falls below half of `level`, then F exceeds `level` on the other side.
std::vector<Crossing> find_crossings(const std::vector<double>& flank, double level, std::size_t half,
                                     double shortness) {
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

/// Mean of |F| while the motor side flies, over all flights longer than the averages; 0 without any.
double torque_in_flight(const std::vector<double>& flank, const std::vector<Crossing>& crossings,
                        std::size_t half) {
  double sum = 0, count = 0;
  for (const Crossing& c : crossings) {
    const auto end = static_cast<std::size_t>(std::max(0.0, c.impact)) - half;
    for (auto i = static_cast<std::size_t>(c.release) + half; i < end && c.impact > static_cast<double>(half);
         ++i) {
      sum += std::abs(flank[i]);
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

struct Flank {
  Pinion pinion;
  std::vector<double> torque;
  double level = 0, noise = 0;
  std::size_t half = 0;
};

/// Standard deviation of F for noise of 1 in every sample of the torque or of the motion.
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

/// The shortest averages that noise does not spoil.
Flank calm_flank(const Motor& motor, bool tachometer, const MomentumTransferSettings& s) {
  const double dt = motor.interval;
  const double longest =
      flexible(s) ? std::max(2.0, kLongestAverage * internal_cycle(s) / dt) : kRigidAverage;
  const double torque = signal::noise_from_differences(motor.torque, 4);
  const std::vector<double>& measured = tachometer ? motor.speed : motor.position;
  const double motion = std::max(signal::noise_from_differences(measured, 4),
                                 signal::smallest_step(measured) / std::sqrt(12.0));
  Flank flank;
  for (flank.half = 2; static_cast<double>(flank.half) <= longest; ++flank.half) {
    flank.pinion = reconstruct(motor, s, flank.half);
    flank.torque = flank_torque(flank.pinion, inertia_at_flank(s), dt, flank.half);
    std::vector<double> sizes;
    for (const double f : flank.torque) sizes.push_back(std::abs(f));
    flank.level = signal::median(std::move(sizes));
    flank.noise = std::hypot(torque * noise_gain(true, tachometer, dt, flank.half, s),
                             motion * noise_gain(false, tachometer, dt, flank.half, s));
    if (kNoiseFree * flank.noise < 0.5 * flank.level) return flank;
  }
  throw Refusal{Status::out_of_domain, fmt::format("impacts cannot be told from noise: the torque on the "
                                                   "flank, {:.4g} N m in the median, has noise of {:.4g} N m",
                                                   flank.level, flank.noise)};
}

void fill(const record::Record& record, const MomentumTransferSettings& s, Estimate& estimate) {
  const Motor motor = collect(record, s);
  const double cycle = internal_cycle(s);
  if (cycle > 0 && cycle < kSamplesPerCycle * motor.interval)
    throw Refusal{Status::out_of_domain,
                  fmt::format("sampled at {:.4g} Hz, but motor and pinion swing against each other at {:.4g} "
                              "Hz: needed are {:.4g} samples per cycle",
                              1 / motor.interval, 1 / cycle, kSamplesPerCycle)};
  const Flank flank = calm_flank(motor, record.has(record::Channel::motor_velocity), s);
  const double shortness =
      shortness_of_impacts(flank.level, static_cast<double>(flank.half) * motor.interval, s);
  const std::vector<Crossing> crossings = find_crossings(flank.torque, flank.level, flank.half, shortness);
  if (crossings.empty())
    throw Refusal{Status::out_of_domain, "the motor side never leaves one flank for the other"};
  if (crossings.size() < kFewestCrossings)
    throw Refusal{Status::insufficient_data, "the gap is crossed " + std::to_string(crossings.size()) +
                                                 " times, needed are " + std::to_string(kFewestCrossings)};
  const double in_flight = torque_in_flight(flank.torque, crossings, flank.half);
  if (in_flight > kFlight * flank.level)
    throw Refusal{
        Status::out_of_domain,
        fmt::format("the motor side does not fly freely between the flanks: {:.4g} N m are left there, "
                    "{:.4g} N m in contact; inertia, damping or friction are not as declared",
                    in_flight, flank.level)};
  // The integral of a speed that jumps between two samples is known to half a sample too.
  const double blur = kTiming * (motor.tachometer ? 1 + shortness : 1);
  std::vector<double> gaps, timing, elastic, speeds;
  for (const Crossing& c : crossings) {
    const auto place = [&](double index) { return at(flank.pinion.position, index) - at(motor.load, index); };
    const double deflection =
        s.flank_deflection ? s.flank_deflection(0.5 * flank.level) + s.flank_deflection(c.impact_torque) : 0;
    gaps.push_back(c.side * (place(c.impact) - place(c.release)) - deflection);
    timing.push_back(std::abs(place(c.impact) - place(c.impact - blur)));
    elastic.push_back(deflection);
    speeds.push_back(std::abs(at(motor.speed, c.impact)));
  }
  const signal::RobustScale scale = signal::robust_scale(gaps, 0);
  const double scatter =
      signal::student_t_quantile(0.975, std::max(1.0, static_cast<double>(gaps.size()) - 1)) * 1.25 *
      scale.deviation / std::sqrt(static_cast<double>(gaps.size()));
  const double half = std::sqrt(scatter * scatter + std::pow(signal::median(timing), 2) +
                                std::pow(kElasticShare * signal::median(elastic), 2));
  const double gap = std::max(0.0, scale.centre);
  estimate.angle_lower = std::max(0.0, scale.centre - half);
  estimate.angle_upper = scale.centre + half;
  if (!(estimate.angle_upper > 0)) {
    estimate.angle_lower = estimate.angle_upper = kNaN;
    throw Refusal{Status::out_of_domain,
                  "the pinion travels less than the flanks yield elastically: the rig is "
                  "not this machine"};
  }
  estimate.status = estimate.angle_lower > 0 ? Status::ok : Status::below_range;
  estimate.backlash_angle = gap;
  estimate.backlash = s.base_radius * gap;
  estimate.lower = s.base_radius * estimate.angle_lower;
  estimate.upper = s.base_radius * estimate.angle_upper;
  estimate.message =
      fmt::format("median of {} crossings, impacts at {:.4g} rad/s, momentum averaged over +-{:.4g} s",
                  gaps.size(), signal::median(speeds), static_cast<double>(flank.half) * motor.interval);
  if (estimate.status == Status::below_range)
    estimate.message += "; contact is lost for no longer than elastic deflection and averaging explain";
}

}  // namespace

Estimate estimate_momentum_transfer(const record::Record& record, const MomentumTransferSettings& settings) {
  check(settings);
  return estimate_or_refusal("momentum_transfer",
                             [&](Estimate& estimate) { fill(record, settings, estimate); });
}

}  // namespace backlash::diagnosis
