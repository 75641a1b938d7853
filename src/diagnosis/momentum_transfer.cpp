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
#include "backlash_diagnosis/signal/spectrum.h"
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
// Without the torque.
constexpr std::size_t kFewestPeriods = 2;   // in the record
constexpr double kRepeats = 0.2;            // choice: of the motion's own product, after a period
constexpr double kNearlyAsHigh = 0.8;       // choice: a period and not two of them
constexpr std::size_t kJumpReach = 3;       // choice: samples to either side of a switch
constexpr double kSamePhase = 2;            // choice: samples
constexpr double kAlike = 0.7;              // choice: share of the crossings
constexpr double kOnCoupling = 0.5;         // simulation: of the longest averages
constexpr double kToldElasticShare = 0.2;   // simulation: the level is told to some 10 %
constexpr std::size_t kFewestInFlight = 3;  // choice: samples per crossing that correct the level
constexpr double kOfRest = 0.7;             // choice: of the play between the places of rest, at least
constexpr double kElasticShare = 0.14;      // of the elastic deflections in the interval

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
  bool torque_measured = true;                  // else told from the motion
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
  const bool torque_measured = record.has(record::Channel::motor_torque);
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

/// Of the averages, half width [samples].
double longest_average(const MomentumTransferSettings& s, double interval) {
  return flexible(s) ? std::max(2.0, kLongestAverage * internal_cycle(s) / interval) : kRigidAverage;
}

/// Standard deviation of the noise of what is measured of the motion; at least that of its steps.
double motion_noise(const Motor& motor) {
  const std::vector<double>& measured = motor.tachometer ? motor.speed : motor.position;
  return std::max(signal::noise_from_differences(measured, 4),
                  signal::smallest_step(measured) / std::sqrt(12.0));
}

/// The shortest averages that noise does not spoil.
Flank calm_flank(const Motor& motor, bool tachometer, const MomentumTransferSettings& s) {
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
    flank.noise = std::hypot(torque * noise_gain(true, tachometer, dt, flank.half, s),
                             motion * noise_gain(false, tachometer, dt, flank.half, s));
    if (kNoiseFree * flank.noise < 0.5 * flank.level) return flank;
  }
  throw Refusal{Status::out_of_domain, fmt::format("impacts cannot be told from noise: the torque on the "
                                                   "flank, {:.4g} N m in the median, has noise of {:.4g} N m",
                                                   flank.level, flank.noise)};
}

/// Of a square wave whose torque is not recorded.
struct Switches {
  double first = 0;        // sample at which the torque becomes positive
  std::size_t period = 0;  // samples

  double sign(std::size_t sample) const {  // of the torque
    const double half = 0.5 * double(period), turn = std::floor((double(sample) - first + kOnTime) / half);
    return std::fmod(std::abs(turn), 2) == 0 ? 1 : -1;
  }

 private:
  static constexpr double kOnTime = 1e-6;  // samples, roundings
};

/// By how much the acceleration jumps behind each sample, seen by the medians of some samples to either side:
/// a knock, which is shorter, does not show.
std::vector<double> jumps_of(const Motor& motor) {
  const std::vector<double> rate = differentiated(motor.speed, motor.interval);
  std::vector<double> jumps(rate.size(), 0.0);
  const auto from = [&](std::size_t i) { return rate.begin() + std::ptrdiff_t(i); };
  for (std::size_t i = kJumpReach; i + kJumpReach + 1 < rate.size(); ++i)
    jumps[i] = signal::median({from(i + 1), from(i + 2 + kJumpReach)}) -
               signal::median({from(i - kJumpReach), from(i + 1)});
  return jumps;
}

/// Samples after which the motion repeats: the first maximum of its mean product with itself later that is
/// nearly as high as any. 0 where none is.
std::size_t period_of(const std::vector<double>& speed) {
  std::vector<double> r = signal::lagged_products(speed, speed.size() / kFewestPeriods);
  for (std::size_t i = 0; i < r.size(); ++i) r[i] /= double(speed.size() - i);
  std::size_t from = 0;
  while (from < r.size() && r[from] > 0) ++from;
  if (from == r.size()) return 0;
  const double most = *std::max_element(r.begin() + std::ptrdiff_t(from), r.end());
  if (most < kRepeats * r[0]) return 0;
  for (std::size_t i = from; i < r.size(); ++i) {
    const std::size_t before = i - i / 5, behind = std::min(r.size(), i + i / 5 + 1);
    if (r[i] > kNearlyAsHigh * most &&
        r[i] >= *std::max_element(r.begin() + std::ptrdiff_t(before), r.begin() + std::ptrdiff_t(behind)))
      return i;
  }
  return 0;
}

/// Position less its mean over a period.
std::vector<double> about_the_middle(const std::vector<double>& position, std::size_t period) {
  const std::vector<double> mean = mean_of_held(position, period / 2);
  std::vector<double> about(position.size());
  for (std::size_t i = 0; i < about.size(); ++i) about[i] = position[i] - mean[i];
  return about;
}

/// The samples [of a rising torque, or half a period later] at which the motor set out for the crossings of
/// the middle that follow a quiet time, as phases within a period: where its acceleration jumps most between
/// standstill and the middle.
std::vector<double> phases_of_switches(const Motor& motor, std::size_t period) {
  const std::vector<double> jumps = jumps_of(motor), about = about_the_middle(motor.position, period),
                            slow = mean_of_held(motor.speed, 2);
  std::vector<double> phases;
  std::size_t last = 0;
  for (std::size_t i = period / 2 + 1; i + period / 2 + 1 < about.size(); ++i) {
    if ((about[i] >= 0) == (about[i - 1] >= 0)) continue;
    const bool quiet = last == 0 || i - last > period / 4;
    last = i;
    if (!quiet) continue;
    const double side = about[i] >= 0 ? 1 : -1;
    std::size_t still = i;
    while (still > 0 && side * slow[still] > 0) --still;
    const std::size_t back = (i - still) / 2 + kJumpReach, from = still > back ? still - back : 0;
    std::size_t best = from;
    for (std::size_t k = from; k < i; ++k)
      if (side * jumps[k] > side * jumps[best]) best = k;
    phases.push_back(std::fmod(double(best + 1) + (side > 0 ? 0 : 0.5 * double(period)), double(period)));
  }
  return phases;
}

Switches find_switches(const Motor& motor) {
  const auto refuse = [](const std::string& reason) {
    throw Refusal{Status::insufficient_data, "the record has no motor_torque, and " + reason};
  };
  Switches s;
  s.period = period_of(motor.speed);
  if (s.period < 8 * kJumpReach) refuse("its motion does not repeat as under a square wave");
  const auto period = double(s.period);
  const std::vector<double> phases = phases_of_switches(motor, s.period);
  // The phase that most of them have, then the median of those.
  std::size_t most = 0;
  for (const double candidate : phases) {
    std::vector<double> near;
    for (const double phase : phases) {
      const double off = std::remainder(phase - candidate, period);
      if (std::abs(off) <= kSamePhase) near.push_back(off);
    }
    if (near.size() <= most) continue;
    most = near.size();
    s.first = candidate + signal::median(std::move(near));
  }
  if (most < kFewestCrossings || double(most) < kAlike * double(phases.size()))
    refuse(fmt::format("only {} of {} crossings of the gap begin at one phase of its period", most,
                       phases.size()));
  s.first = std::fmod(s.first, period) - period;
  return s;
}

/// A level [N m] that leaves least in flight and at rest: F is F0 + level * unit, F0 without any torque. At
/// rest the flank carries the torque, in flight nothing; a knock, which is neither, counts alike for all.
double level_of(const std::vector<double>& without, const std::vector<double>& unit, const Switches& switches,
                std::size_t half) {
  const auto left = [&](double level) {
    double sum = 0;
    for (std::size_t i = half; i + half < without.size(); ++i) {
      const double f = without[i] + level * unit[i];
      sum += std::min(std::abs(f), std::abs(f - level * switches.sign(i)));
    }
    return sum;
  };
  std::vector<double> sizes;
  for (const double f : without) sizes.push_back(std::abs(f));
  const double most = signal::quantile(std::move(sizes), 0.99);
  double best = 0, least = left(0);
  for (double step = most / 50, from = 0, to = most; step > 1e-4 * most;
       from = std::max(0.0, best - step), to = best + step, step *= 0.1)
    for (double level = from; level <= to; level += step)
      if (const double l = left(level); l < least) least = l, best = level;
  return best;
}

/// The torque of a square wave from the motion alone; replaces `motor.torque`. With the shortest averages
/// that noise does not spoil.
void tell_torque(Motor& motor, const MomentumTransferSettings& s) {
  const Switches switches = find_switches(motor);
  Motor unit = motor;
  std::fill(unit.speed.begin(), unit.speed.end(), 0.0);
  std::fill(unit.position.begin(), unit.position.end(), 0.0);
  for (std::size_t i = 0; i < unit.torque.size(); ++i) unit.torque[i] = switches.sign(i);
  const double noise = motion_noise(motor);
  const double longest = longest_average(s, motor.interval);
  // On a coupling the level is that of flights between its swings: from half of the longest averages on.
  const auto shortest = flexible(s) ? std::max(std::size_t(2), std::size_t(kOnCoupling * longest)) : 2;
  for (std::size_t half = shortest; double(half) <= longest; ++half) {
    const auto flank = [&](const Motor& m) {
      return flank_torque(reconstruct(m, s, half), inertia_at_flank(s), m.interval, half);
    };
    const double level = level_of(flank(motor), flank(unit), switches, half);
    if (!(level > 2 * kNoiseFree * noise * noise_gain(false, motor.tachometer, motor.interval, half, s)))
      continue;
    for (std::size_t i = 0; i < motor.torque.size(); ++i) motor.torque[i] = level * unit.torque[i];
    return;
  }
  throw Refusal{
      Status::out_of_domain,
      "the record has no motor_torque, and no level of a square wave stands out of the noise of the "
      "motion"};
}

/// In long flights the flank carries nothing: what is left there corrects the level of the told torque.
void settle_level(Motor& motor, const MomentumTransferSettings& s) {
  for (int round = 0; round < 2; ++round) {
    const Flank flank = calm_flank(motor, motor.tachometer, s);
    const double shortness = shortness_of_impacts(flank.level, double(flank.half) * motor.interval, s);
    const std::vector<Crossing> crossings = find_crossings(flank.torque, flank.level, flank.half, shortness);
    std::vector<double> left;
    for (const Crossing& c : crossings)
      for (double i = std::ceil(c.release) + double(flank.half); i < c.impact - double(flank.half); ++i)
        left.push_back(std::copysign(1, motor.torque[std::size_t(i)]) * flank.torque[std::size_t(i)]);
    if (left.size() < kFewestInFlight * std::max<std::size_t>(1, crossings.size())) return;
    const double level = std::abs(motor.torque.front()), better = level - signal::median(std::move(left));
    if (!(better > 0.5 * level && better < 2 * level)) return;  // no correction: refused for what is left
    for (double& torque : motor.torque) torque *= better / level;
  }
}

/// Play [rad] between where the motor is in the last quarter of its times of positive and of negative torque,
/// less what yields elastically. A motor that still bounces there is nearer to the middle: a lower bound.
double play_at_rest(const Motor& motor, const MomentumTransferSettings& s) {
  const auto place = [&](std::size_t i) { return motor.position[i] - motor.load[i]; };
  std::size_t begin = 0;
  std::vector<double> differences;
  double before = kNaN;
  for (std::size_t i = 1; i < motor.torque.size(); ++i) {
    if (motor.torque[i] == motor.torque[i - 1]) continue;
    std::vector<double> end;
    for (std::size_t k = i - (i - begin) / 4; k < i; ++k) end.push_back(place(k));
    const double here = end.empty() ? kNaN : signal::median(std::move(end));
    const double difference = std::copysign(1, motor.torque[i - 1]) * (here - before);
    if (std::isfinite(difference)) differences.push_back(difference);
    before = here, begin = i;
  }
  const double level = std::abs(motor.torque.front());
  const double yields =
      (flexible(s) ? level / s.coupling_stiffness : 0) + (s.flank_deflection ? s.flank_deflection(level) : 0);
  return differences.empty() ? kNaN : signal::median(std::move(differences)) - 2 * yields;
}

/// The crossings of the gap; refuses where they are too few or no free flights.
std::vector<Crossing> free_crossings(const Flank& flank, double shortness) {
  std::vector<Crossing> crossings = find_crossings(flank.torque, flank.level, flank.half, shortness);
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
  return crossings;
}

/// Of a told torque: refuses what contradicts the places of rest.
void check_rest(const Motor& motor, const MomentumTransferSettings& s, Estimate& estimate) {
  const double least = play_at_rest(motor, s), upper = estimate.angle_upper;
  if (upper > kOfRest * least) return;
  estimate.angle_lower = estimate.angle_upper = kNaN;
  throw Refusal{Status::out_of_domain,
                fmt::format("the record has no motor_torque, and what is told from the motion contradicts "
                            "itself: at most {:.3g} rad of flight, {:.3g} rad between the places of rest",
                            upper, least)};
}

void fill(const record::Record& record, const MomentumTransferSettings& s, Estimate& estimate) {
  Motor motor = collect(record, s);
  const double cycle = internal_cycle(s);
  if (cycle > 0 && cycle < kSamplesPerCycle * motor.interval)
    throw Refusal{Status::out_of_domain,
                  fmt::format("sampled at {:.4g} Hz, but motor and pinion swing against each other at {:.4g} "
                              "Hz: needed are {:.4g} samples per cycle",
                              1 / motor.interval, 1 / cycle, kSamplesPerCycle)};
  if (!motor.torque_measured) {
    tell_torque(motor, s);
    settle_level(motor, s);
  }
  const Flank flank = calm_flank(motor, record.has(record::Channel::motor_velocity), s);
  const double shortness =
      shortness_of_impacts(flank.level, static_cast<double>(flank.half) * motor.interval, s);
  const std::vector<Crossing> crossings = free_crossings(flank, shortness);
  // The integral of a speed that jumps between two samples is known to half a sample too.
  const double blur = kTiming * (motor.tachometer ? 1 + shortness : 1);
  const double elastic_share = motor.torque_measured ? kElasticShare : kToldElasticShare;
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
                                std::pow(elastic_share * signal::median(elastic), 2));
  const double gap = std::max(0.0, scale.centre);
  estimate.angle_lower = std::max(0.0, scale.centre - half);
  estimate.angle_upper = scale.centre + half;
  if (!(estimate.angle_upper > 0)) {
    estimate.angle_lower = estimate.angle_upper = kNaN;
    throw Refusal{Status::out_of_domain,
                  "the pinion travels less than the flanks yield elastically: the rig is "
                  "not this machine"};
  }
  if (!motor.torque_measured) check_rest(motor, s, estimate);
  estimate.status = estimate.angle_lower > 0 ? Status::ok : Status::below_range;
  estimate.backlash_angle = gap;
  estimate.backlash = s.base_radius * gap;
  estimate.lower = s.base_radius * estimate.angle_lower;
  estimate.upper = s.base_radius * estimate.angle_upper;
  estimate.message =
      fmt::format("median of {} crossings, impacts at {:.4g} rad/s, momentum averaged over +-{:.4g} s",
                  gaps.size(), signal::median(speeds), static_cast<double>(flank.half) * motor.interval);
  if (!motor.torque_measured)
    estimate.message += fmt::format("; torque told from the motion, a square wave of {:.4g} N m",
                                    std::abs(motor.torque.front()));
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
