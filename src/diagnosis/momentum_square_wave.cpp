// SPDX-License-Identifier: BSD-3-Clause
#include "momentum_square_wave.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/spectrum.h"
#include "refusal.h"

namespace backlash::diagnosis::momentum {
namespace {

constexpr std::size_t kFewestPeriods = 2;   // choice: in the record
constexpr double kRepeats = 0.2;            // choice: of the motion's own product, after a period
constexpr double kNearlyAsHigh = 0.8;       // choice: a period and not two of them
constexpr std::size_t kJumpReach = 3;       // choice: samples to either side of a switch
constexpr double kSamePhase = 2;            // choice: samples
constexpr double kAlike = 0.7;              // choice: share of the crossings
constexpr double kOnCoupling = 0.5;         // simulation: of the longest averages
constexpr std::size_t kFewestInFlight = 3;  // choice: samples per crossing that correct the level
constexpr double kOfRest = 0.7;             // choice: of the play between the places of rest, at least
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

/// In long flights the flank carries nothing: what is left there corrects the level of the estimated torque.
void settle_level(Motor& motor, const MomentumTransferSettings& s) {
  for (int round = 0; round < 2; ++round) {
    const Flank flank = calm_flank(motor, s);
    const double shortness = shortness_of_impacts(flank, motor.interval, s);
    const std::vector<Crossing> crossings = find_crossings(flank, shortness);
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

/// With the shortest averages that noise does not spoil.
void estimate_level(Motor& motor, const MomentumTransferSettings& s) {
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

}  // namespace

void estimate_torque(Motor& motor, const MomentumTransferSettings& s) {
  estimate_level(motor, s);
  settle_level(motor, s);
}

void check_rest(const Motor& motor, const MomentumTransferSettings& s, Estimate& estimate) {
  const double least = play_at_rest(motor, s), upper = estimate.angle_upper;
  if (upper > kOfRest * least) return;
  estimate.angle_lower = estimate.angle_upper = kNaN;
  throw Refusal{
      Status::out_of_domain,
      fmt::format("the record has no motor_torque, and what is estimated from the motion contradicts "
                  "itself: at most {:.3g} rad of flight, {:.3g} rad between the places of rest",
                  upper, least)};
}

}  // namespace backlash::diagnosis::momentum
