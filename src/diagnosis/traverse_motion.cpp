// SPDX-License-Identifier: BSD-3-Clause
#include "traverse_motion.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "refusal.h"

namespace backlash::diagnosis {
namespace {

// All choices, tried on simulated machines, but where another origin is given.
constexpr double kCycleSamples = 8;  // fewest samples in a cycle of the motor against the load
constexpr double kStep = 0.06;       // of the integration times the fastest frequency, rad
constexpr double kBefore = 0.8;      // cycles of a window before a crossing: tell the start
constexpr double kAfter = 2.6;       // and from its begin on: the first touches
constexpr double kCounted = 0.5;     // share of a window in which the motor moves
constexpr double kUneven = 0.25;     // of an interval, from one sample to the next
constexpr double kClear = 4.4;       // noises of the averaged torque, above which it presses a flank
constexpr double kAveraged = 0.16;   // cycles, half width of the average
constexpr double kSlow = 0.02;       // of the rms speed: there dry friction takes any value
constexpr double kFade = 0.01;       // of it: the load's friction turns its sign within
constexpr std::size_t kFewestSamples = 256;

/// Value and slope per sample of a quadratic over `reach` samples to each side (Savitzky and Golay 1964).
struct Quadratic {
  std::vector<double> value, slope;
  std::size_t reach;

  explicit Quadratic(std::size_t to_each_side) : reach(to_each_side) {
    const auto m = static_cast<double>(reach);
    for (double k = -m; k <= m; ++k) {
      value.push_back((3 * (3 * m * m + 3 * m - 1) - 15 * k * k) / ((2 * m - 1) * (2 * m + 1) * (2 * m + 3)));
      slope.push_back(3 * k / (m * (m + 1) * (2 * m + 1)));
    }
  }

  double of(const std::vector<double>& x, std::size_t i, const std::vector<double>& weights) const {
    double sum = 0;
    for (std::size_t k = 0; k < weights.size(); ++k) sum += weights[k] * x[i + k - reach];
    return sum;
  }
};

/// What the weights leave of the noise of a torque of which two samples are averaged, and of second
/// differences of positions [N m].
double noise_of(const std::vector<double>& weights, double torque, double differences) {
  double squares = 0;
  const auto at = [&](std::ptrdiff_t i) {
    return i < 0 || i >= std::ptrdiff_t(weights.size()) ? 0 : weights[std::size_t(i)];
  };
  for (std::ptrdiff_t i = -1; i <= std::ptrdiff_t(weights.size()); ++i)
    squares += std::pow(0.5 * torque * (at(i) + at(i - 1)), 2) +
               std::pow(differences * (at(i - 1) - 2 * at(i) + at(i + 1)), 2);
  return std::sqrt(squares);
}

double cycle_of(const GapTraverseSettings& s) {
  return 2 * M_PI / std::sqrt(s.stiffness * (1 / s.motor_inertia + 1 / s.load_inertia));
}

void check_samples(const record::Record& record, double interval, double cycle) {
  if (record.size() < kFewestSamples) throw Refusal{Status::insufficient_data, "fewer than 256 samples"};
  if (!(interval * kCycleSamples < cycle))
    throw Refusal{Status::out_of_domain,
                  fmt::format("a sample each {:.3g} s does not resolve the cycle of {:.3g} s of the motor "
                              "against the load",
                              interval, cycle)};
  for (std::size_t i = 1; i < record.size(); ++i) {
    const double step = record.time[i] - record.time[i - 1];
    if (std::fabs(step - interval) > kUneven * interval)
      throw Refusal{Status::out_of_domain,
                    fmt::format("the samples are not evenly spaced in time at {:.6g} s", record.time[i])};
  }
}

/// What the motor leaves for the teeth.
std::vector<double> torque_of_teeth(const TraverseData& d, const TraverseMotor& motor) {
  std::vector<double> teeth(d.torque.size(), 0.0);
  for (std::size_t i = 1; i + 1 < teeth.size(); ++i)
    teeth[i] = 0.5 * (d.torque[i] + d.torque[i - 1]) - motor.inertia * d.acceleration[i] -
               motor.damping * d.rate[i] - std::copysign(motor.friction, d.rate[i]);
  return teeth;
}

std::size_t reach_of(const TraverseData& d, double cycle) {
  return std::max<std::size_t>(2, std::size_t(std::lround(kAveraged * cycle / d.interval)));
}

void find_windows(TraverseData& d, const std::vector<double>& teeth, double cycle, double unsure) {
  const std::size_t n = teeth.size();
  const Quadratic quadratic(reach_of(d, cycle));
  std::vector<double> smooth(n, 0.0), pressed;
  std::vector<int> flank(n, 0);
  const double clear = kClear * d.noise;
  for (std::size_t i = quadratic.reach + 1; i + quadratic.reach + 1 < n; ++i) {
    smooth[i] = quadratic.of(teeth, i, quadratic.value);
    if (std::fabs(smooth[i]) < clear) continue;
    flank[i] = smooth[i] > 0 ? 1 : -1;
    pressed.push_back(std::fabs(smooth[i]));
  }
  d.clear = clear + unsure;
  if (!pressed.empty()) d.level = signal::median(pressed);
  const auto before = static_cast<std::size_t>(std::lround(kBefore * cycle / d.interval));
  d.samples = before + static_cast<std::size_t>(std::lround(kAfter * cycle / d.interval));
  std::size_t last = 0, free_from = 3;  // last sample on a flank; where the next window may begin
  for (std::size_t i = 3; i < n; ++i) {
    if (flank[i] == 0) continue;
    const std::size_t left = last;
    last = i;
    if (left == 0 || flank[left] == flank[i]) continue;
    ++d.crossings;
    std::size_t first = left > before ? left - before : 0;
    const auto sure = [&](std::size_t k) {
      return k > 2 + quadratic.reach && flank[left] * smooth[k] > d.clear;
    };
    while (first < left && !sure(first)) ++first;
    if (first < free_from || !sure(first) || first + d.samples + quadratic.reach + 1 >= n ||
        i + d.samples / 8 > first + d.samples)
      continue;
    const auto from = d.counts.begin() + std::ptrdiff_t(first), to = from + std::ptrdiff_t(d.samples);
    if (double(std::count(from, to, 1)) < kCounted * double(d.samples)) continue;
    d.windows.push_back({first, double(flank[first]), smooth[first],
                         quadratic.of(teeth, first, quadratic.slope) / d.interval});
    free_from = first + d.samples / 2;
  }
}

/// Motor between two samples: a cubic through positions and rates.
struct Motor {
  double position, rate;
};

class Cubic {
 public:
  Cubic(const TraverseData& d, std::size_t i)
      : q0_(d.position[i]),
        q1_(d.position[i + 1]),
        v0_(d.rate[i] * d.interval),
        v1_(d.rate[i + 1] * d.interval),
        interval_(d.interval) {}

  Motor at(double u) const {
    const double u2 = u * u, u3 = u2 * u;
    return {
        (2 * u3 - 3 * u2 + 1) * q0_ + (u3 - 2 * u2 + u) * v0_ + (3 * u2 - 2 * u3) * q1_ + (u3 - u2) * v1_,
        ((6 * u2 - 6 * u) * (q0_ - q1_) + (3 * u2 - 4 * u + 1) * v0_ + (3 * u2 - 2 * u) * v1_) / interval_};
  }

 private:
  double q0_, q1_, v0_, v1_, interval_;
};

struct Load {
  double position, rate;
};

/// The teeth yield as a spring does at the usual torque `level`, and by a power of it elsewhere. Damping
/// follows: constant for a spring and as the torque after Hertz (Hunt and Crossley 1975), between them by 3
/// (power - 1).
class Teeth {
 public:
  Teeth(const TraverseMachine& m, double level)
      : half_gap_(0.5 * m[kTraverseGap]),
        stiffness_(m[kTraverseStiffness]),
        damping_(m[kTraverseDamping]),
        power_(m[kTraversePower]),
        level_(level) {}

  /// Never tensile.
  double torque(const Motor& motor, const Load& load) const {
    const double x = motor.position - load.position, in = std::fabs(x) - half_gap_;
    if (in <= 0) return 0;
    const double side = x > 0 ? 1 : -1;
    const double harder = std::exp((power_ - 1) * std::log(stiffness_ * in / level_));
    const double damping = power_ > 1 ? damping_ * harder * harder * harder : damping_;
    const double force = stiffness_ * in * harder + damping * side * (motor.rate - load.rate);
    return force > 0 ? side * force : 0;
  }

  /// The load as far behind the motor as a torque through the teeth says that changes at this rate.
  Load under(double torque, double torque_rate, double side, const Motor& motor) const {
    const double in = level_ / stiffness_ * std::pow(std::fabs(torque) / level_, 1 / power_);
    return {motor.position - side * (half_gap_ + in),
            motor.rate - in * torque_rate / (power_ * std::fabs(torque))};
  }

 private:
  double half_gap_, stiffness_, damping_, power_, level_;
};

}  // namespace

TraverseData traverse_data(const record::Record& record, const GapTraverseSettings& settings,
                           const TraverseMotor& motor) {
  TraverseData d;
  d.interval = record.sampling_interval();
  const double cycle = cycle_of(settings);
  check_samples(record, d.interval, cycle);
  d.steps = std::max(1, static_cast<int>(std::ceil(2 * M_PI * d.interval / (cycle * kStep))));
  d.torque = record.column(record::Channel::motor_torque);
  d.position = record.column(record::Channel::motor_position);
  const std::size_t n = d.position.size();
  d.rate.assign(n, 0), d.acceleration.assign(n, 0), d.counts.assign(n, 0);
  double squares = 0;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    d.rate[i] = (d.position[i + 1] - d.position[i - 1]) / (2 * d.interval);
    d.acceleration[i] =
        (d.position[i + 1] - 2 * d.position[i] + d.position[i - 1]) / (d.interval * d.interval);
    squares += d.rate[i] * d.rate[i] / static_cast<double>(n);
  }
  if (!(squares > 0)) throw Refusal{Status::insufficient_data, "the motor does not move"};
  d.slow = kFade * std::sqrt(squares);
  for (std::size_t i = 0; i < n; ++i) d.counts[i] = std::fabs(d.rate[i]) > kSlow * std::sqrt(squares);
  const std::vector<double> teeth = torque_of_teeth(d, motor);
  d.torque_noise = signal::noise_from_differences(d.torque, 2);
  d.position_noise = std::max(signal::noise_from_differences(d.position, 4),
                              signal::smallest_step(d.position) / std::sqrt(12.0));
  const Quadratic quadratic(reach_of(d, cycle));
  const double differences = motor.inertia * d.position_noise / (d.interval * d.interval);
  d.noise = noise_of(quadratic.value, d.torque_noise, differences);
  d.slope_noise = noise_of(quadratic.slope, d.torque_noise, differences) / d.interval;
  find_windows(d, teeth, cycle, motor.unsure);
  return d;
}

void traverse_residual(const TraverseData& d, const TraverseWindow& window, const TraverseMachine& m,
                       const TraverseOwn& own, double* to) {
  const double dt = d.interval / d.steps, inertia = m[kTraverseLoadInertia];
  const Teeth teeth(m, d.level);
  Load load = teeth.under(window.torque, window.torque_rate, window.side,
                          {d.position[window.first], d.rate[window.first]});
  load.position += own[0];
  load.rate += own[1];
  const auto acceleration = [&](double torque, double rate) {
    return (torque - own[3] - m[kTraverseLoadFriction] * std::clamp(rate / d.slow, -1.0, 1.0)) / inertia;
  };
  // Weighted 1 - |t| / interval about each sample, which is what a second difference of the position sees.
  double mean = 0, next = 0;
  for (std::size_t k = 0; k + 1 < d.samples; ++k) {
    const std::size_t i = window.first + k;
    const Cubic motor(d, i);
    mean = next, next = 0;
    for (int s = 0; s < d.steps; ++s) {
      const double u = double(s) / d.steps, half = u + 0.5 / d.steps, end = u + 1.0 / d.steps;
      const double f = teeth.torque(motor.at(u), load);
      mean += (1 - u) * f / d.steps, next += u * f / d.steps;
      const double a1 = acceleration(f, load.rate);
      const Load l2{load.position + 0.5 * dt * load.rate, load.rate + 0.5 * dt * a1};
      const double a2 = acceleration(teeth.torque(motor.at(half), l2), l2.rate);
      const Load l3{load.position + 0.5 * dt * l2.rate, load.rate + 0.5 * dt * a2};
      const double a3 = acceleration(teeth.torque(motor.at(half), l3), l3.rate);
      const Load l4{load.position + dt * l3.rate, load.rate + dt * a3};
      const double a4 = acceleration(teeth.torque(motor.at(end), l4), l4.rate);
      load.position += dt * (load.rate + 2 * l2.rate + 2 * l3.rate + l4.rate) / 6;
      load.rate += dt * (a1 + 2 * a2 + 2 * a3 + a4) / 6;
    }
    const double drive = (1 - m[kTraverseEarlier]) * d.torque[i] + m[kTraverseEarlier] * d.torque[i - 1];
    const double need = mean + own[2] + m[kTraverseMotorInertia] * d.acceleration[i] +
                        m[kTraverseMotorDamping] * d.rate[i] +
                        std::copysign(m[kTraverseMotorFriction], d.rate[i]);
    to[k] = k > 0 && d.counts[i] ? drive - need : 0;
  }
  to[d.samples - 1] = 0;
}

}  // namespace backlash::diagnosis
