// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_motion.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "lanes_power.h"

namespace backlash::diagnosis {
namespace {

using Lanes = double __attribute__((vector_size(8 * kWaveformSets)));

DIAGNOSIS_LANES Lanes positive(const Lanes& a) {
  return a > 0 ? a : Lanes{};
}
DIAGNOSIS_LANES Lanes magnitude(const Lanes& a) {
  return a < 0 ? -a : a;
}
DIAGNOSIS_LANES Lanes root(const Lanes& a) {
  double each[kWaveformSets];  // a loop over these becomes one instruction for all of them
  std::memcpy(each, &a, sizeof each);
  for (double& value : each) value = std::sqrt(value);
  Lanes r;
  std::memcpy(&r, each, sizeof r);
  return r;
}

struct State {
  Lanes qm, wm, qp, wp, qg, wg, ql, wl;
};

/// v where the machine has it.
DIAGNOSIS_LANES Lanes per_inertia(const Lanes& v) {
  return v > 0 ? 1 / v : Lanes{};
}

/// By what power of their penetration the teeth resist.
enum class Teeth { line, power, hertz };

template <Teeth Law>
struct Train {
  Lanes half_gap, motor_damping, dry, slow, ki, ci, per_jm, per_jp, per_jg, ko, co, contact, loss, slope;
  Lanes per_jl, link_damping, link_dry, contact_damping;
  double lever, exponent;
  WaveformOutput behind;

  DIAGNOSIS_LANES explicit Train(const Lanes* v, const WaveformGrid& grid)
      : half_gap(v[kHalfGap]),
        motor_damping(v[kMotorDamping]),
        dry(positive(v[kDryFriction])),
        slow(v[kFrictionSpeed]),
        ki(v[kSensorStiffness]),
        ci(v[kSensorDamping]),
        per_jm(1 / v[kMotorInertia]),
        per_jp(1 / v[kPinionInertia]),
        per_jg(per_inertia(v[kGearInertia])),
        ko(v[kOutputStiffness]),
        co(v[kOutputDamping]),
        contact(v[kContactStiffness]),
        loss(1.5 * v[kContactLoss]),
        slope(v[kDriveSlope]),
        per_jl(per_inertia(v[kLinkInertia])),
        link_damping(v[kLinkDamping]),
        link_dry(positive(v[kLinkFriction])),
        contact_damping(v[kContactDamping]),
        lever(grid.base_radius),
        exponent(grid.exponent),
        behind(grid.output) {}

  /// At penetration `depth` [m], approaching at `rate` [m/s]: N, no tension.
  DIAGNOSIS_LANES Lanes push(const Lanes& depth, const Lanes& rate) const {
    if constexpr (Law == Teeth::hertz) return contact * depth * root(depth) * positive(1 + loss * rate);
    const Lanes spring = Law == Teeth::line ? contact * depth : contact * lanes_power(depth, exponent);
    const Lanes force = positive(spring * (1 + loss * rate) + contact_damping * rate);
    return depth > 0 ? force : Lanes{};
  }

  /// Penetration of one set at rest, m, and its stiffness there, N m/rad.
  std::pair<double, double> pressed(double torque, int set) const {
    const double force = torque / lever;
    if constexpr (Law == Teeth::hertz) {
      const double depth = std::cbrt(force / contact[set] * force / contact[set]);
      return {depth, 1.5 * contact[set] * std::sqrt(depth) * lever * lever};
    }
    const double depth = std::pow(force / contact[set], 1 / exponent);
    return {depth, exponent * force / depth * lever * lever};
  }

  /// Of the gear and of the link, rad/s^2.
  DIAGNOSIS_LANES void output(const State& s, const Lanes& teeth, State& rate) const {
    if (behind == WaveformOutput::locked) {
      rate.wg = (teeth - ko * s.qg - co * s.wg) * per_jg;
    } else if (behind == WaveformOutput::link) {
      rate.wg = (teeth - link_damping * s.wg) * per_jl;
    } else {
      const Lanes out = ko * (s.qg - s.ql) + co * (s.wg - s.wl);
      rate.wg = (teeth - out) * per_jg;
      rate.ql = s.wl;
      rate.wl = (out - link_damping * s.wl) * per_jl;
    }
  }

  DIAGNOSIS_LANES State rate(const State& s, const Lanes& drive) const {
    const Lanes x = lever * (s.qp - s.qg), v = lever * (s.wp - s.wg);
    const Lanes depth = positive(magnitude(x) - half_gap);
    const Lanes pushed = lever * push(depth, x < 0 ? -v : v);
    const Lanes teeth = x < 0 ? -pushed : pushed;
    const Lanes sensor = ki * (s.qm - s.qp) + ci * (s.wm - s.wp);
    State rate{};
    rate.qm = s.wm, rate.wm = (drive + slope * s.qm - motor_damping * s.wm - sensor) * per_jm;
    rate.qp = s.wp, rate.wp = (sensor - teeth) * per_jp;
    rate.qg = s.wg;
    output(s, teeth, rate);
    return rate;
  }

  DIAGNOSIS_LANES State along(const State& s, const State& r, double h) const {
    State next{};
    next.qm = s.qm + h * r.qm, next.wm = s.wm + h * r.wm;
    next.qp = s.qp + h * r.qp, next.wp = s.wp + h * r.wp;
    next.qg = s.qg + h * r.qg, next.wg = s.wg + h * r.wg;
    if (behind == WaveformOutput::coupled_link) next.ql = s.ql + h * r.ql, next.wl = s.wl + h * r.wl;
    return next;
  }

  DIAGNOSIS_LANES void step(const Lanes& drive, double h, State& s) const {
    const State a = rate(s, drive), b = rate(along(s, a, h / 2), drive);
    const State c = rate(along(s, b, h / 2), drive), d = rate(along(s, c, h), drive);
    s = along(along(along(along(s, a, h / 6), b, h / 3), c, h / 3), d, h / 6);
    brake(dry * per_jm * h, h, s.qm, s.wm);
    if (behind == WaveformOutput::link) brake(link_dry * per_jl * h, h, s.qg, s.wg);
    if (behind == WaveformOutput::coupled_link) brake(link_dry * per_jl * h, h, s.ql, s.wl);
  }

  /// Dry friction of one step, implicitly, so that what sticks stays: `most` is the speed that it takes at
  /// most.
  DIAGNOSIS_LANES void brake(const Lanes& most, double h, Lanes& angle, Lanes& speed) const {
    const Lanes slips = speed < 0 ? speed + most : speed - most;
    const Lanes next = magnitude(speed) > slow + most ? slips : speed * slow / (slow + most);
    angle -= 0.5 * h * (speed - next);
    speed = next;
  }
};

/// 5 ms before a reversal nothing else moves: the gear of a locked output follows the pinion on its flank; a
/// free link is driven by it.
template <Teeth Law>
DIAGNOSIS_LANES State start(const Train<Law>& train, const WaveformWindow& window, const Lanes* v) {
  const Lanes load = positive(v[kStartFlank]);
  Lanes depth = {}, share = {};
  for (int i = 0; i < kWaveformSets; ++i) {
    if (!(load[i] > 0)) continue;
    const auto [deep, stiffness] = train.pressed(load[i], i);
    depth[i] = deep;
    share[i] = train.behind == WaveformOutput::locked ? stiffness / (stiffness + train.ko[i]) : 1;
  }
  const Lanes off = v[kStartFlank] < 0 ? v[kStartFlank] / train.ki : Lanes{};
  State s{};
  if (train.behind == WaveformOutput::locked) s.qg = window.side * load / train.ko;
  s.qp = s.qg + window.side * ((train.half_gap + depth) / train.lever + off);
  s.qm = s.qp + window.side * v[kStartTwist] / train.ki;
  s.wp = window.side * v[kStartPinionRate] / (kWaveformRateTime * train.ki);
  s.wm = s.wp + window.side * v[kStartTwistRate] / (kWaveformRateTime * train.ki);
  s.wg = s.wp * share;
  if (train.behind != WaveformOutput::locked)
    s.wg = s.wp + window.side * v[kStartGearRate] / (kWaveformRateTime * train.ki);
  if (train.behind == WaveformOutput::coupled_link) {
    s.ql = -window.side * load / train.ko * train.per_jg / (train.per_jg + train.per_jl);
    s.wl = s.wg;
  }
  return s;
}

DIAGNOSIS_LANES void put(const Lanes& from, std::array<double, kWaveformSets>& to) {
  std::memcpy(to.data(), &from, sizeof from);
}

/// Torque `lag` ago, by the cubic through values and rates at either end of a step of the integration
/// (Hermite). Between samples it would miss some per cent of the ring.
double lagged(const WaveformRows& torque, const WaveformRows& rate, int step, std::size_t set, double lag,
              double interval) {
  const double x = step - lag / interval;
  const int last = static_cast<int>(torque.size()) - 2;
  const int k = std::clamp(static_cast<int>(std::floor(x)), 0, last);
  const std::size_t i = static_cast<std::size_t>(k);
  const double u = x - k, p = torque[i][set], q = torque[i + 1][set];
  const double r = rate[i][set] * interval, s = rate[i + 1][set] * interval;
  if (u < 0) return p + u * r;
  if (u > 1) return q + (u - 1) * s;
  return p + u * (r + u * (3 * (q - p) - 2 * r - s + u * (2 * (p - q) + r + s)));
}

/// Torque of the motor over one step, N m.
class Drive {
 public:
  DIAGNOSIS_LANES Drive(const WaveformWindow& window, const WaveformGrid& grid, const Lanes& delay)
      : window_(window), grid_(grid), delay_(delay), change_(window.reversal + delay) {}

  DIAGNOSIS_LANES Lanes at(std::size_t sample, int j) const {
    const double h = grid_.interval / grid_.steps;
    if (window_.drive.empty()) {
      const Lanes part = (change_ - (static_cast<double>(sample) * grid_.interval + j * h)) / h;
      const Lanes share = part < 0 ? Lanes{} : part > 1 ? Lanes{} + 1 : part;  // of it before the reversal
      return share * window_.before + (1 - share) * window_.after;
    }
    const double here = window_.drive[sample], next = window_.drive[sample + 1];
    return here + ((j + 0.5) * h - delay_) / grid_.interval * (next - here);
  }

 private:
  const WaveformWindow& window_;
  const WaveformGrid& grid_;
  Lanes delay_, change_;
};

template <Teeth Law>
DIAGNOSIS_LANES void move_all(const WaveformWindow& window, const WaveformGrid& grid, int samples,
                              const WaveformSets& sets, WaveformMotion& motion) {
  Lanes v[kAllValues];
  for (std::size_t k = 0; k < kAllValues; ++k)
    for (std::size_t i = 0; i < kWaveformSets; ++i) v[k][static_cast<int>(i)] = sets[k][i];
  const Train<Law> train(v, grid);
  State s = start(train, window, v);
  const double h = grid.interval / grid.steps;
  const Drive drive(window, grid, v[kSwitchDelay]);
  const Lanes zero = v[kPositionZero] + v[kStartZero];
  const auto count = static_cast<std::size_t>(samples);
  static thread_local WaveformRows torque, rate;
  const auto steps = static_cast<std::size_t>(grid.steps), all = (count - 1) * steps + 1;
  torque.resize(all), rate.resize(all);
  motion.torque.resize(count), motion.position.resize(count);
  const Lanes damper = grid.sensor_with_damper ? train.ci : Lanes{};
  const Lanes follow = h / (h + positive(v[kSensorTime]));  // of a step, by the sensor: implicit Euler
  Lanes shown = train.ki * (s.qm - s.qp) + damper * (s.wm - s.wp), shown_rate = train.ki * (s.wm - s.wp);
  for (std::size_t k = 0; k < count; ++k) {
    put(s.qm + zero, motion.position[k]);
    for (std::size_t j = 0; j < steps; ++j) {
      put(v[kSensorGain] * shown + v[kSensorBias], torque[k * steps + j]);
      put(v[kSensorGain] * shown_rate, rate[k * steps + j]);
      if (k + 1 == count) break;
      train.step(drive.at(k, static_cast<int>(j)) + v[kDriveOffset], h, s);
      shown += follow * (train.ki * (s.qm - s.qp) + damper * (s.wm - s.wp) - shown);
      shown_rate += follow * (train.ki * (s.wm - s.wp) - shown_rate);
    }
  }
  for (std::size_t k = 0; k < count; ++k)
    for (std::size_t i = 0; i < kWaveformSets; ++i)
      motion.torque[k][i] = lagged(torque, rate, static_cast<int>(k * steps), i, sets[kSensorLag][i], h);
}

DIAGNOSIS_LANES void move_any(const WaveformWindow& window, const WaveformGrid& grid, int samples,
                              const WaveformSets& sets, WaveformMotion& motion) {
  if (grid.exponent == kHertzExponent) return move_all<Teeth::hertz>(window, grid, samples, sets, motion);
  if (grid.exponent == 1) return move_all<Teeth::line>(window, grid, samples, sets, motion);
  move_all<Teeth::power>(window, grid, samples, sets, motion);
}

#if defined(__x86_64__)
__attribute__((target("avx512f,prefer-vector-width=512"))) void move_avx512(const WaveformWindow& window,
                                                                            const WaveformGrid& grid,
                                                                            int samples,
                                                                            const WaveformSets& sets,
                                                                            WaveformMotion& motion) {
  move_any(window, grid, samples, sets, motion);
}

__attribute__((target("avx2"))) void move_avx2(const WaveformWindow& window, const WaveformGrid& grid,
                                               int samples, const WaveformSets& sets,
                                               WaveformMotion& motion) {
  move_any(window, grid, samples, sets, motion);
}
#endif

}  // namespace

void move_waveform(const WaveformWindow& window, const WaveformGrid& grid, int samples,
                   const WaveformSets& sets, WaveformMotion& motion) {
#if defined(__x86_64__)
  static const bool has_avx512 = __builtin_cpu_supports("avx512f");
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx512) return move_avx512(window, grid, samples, sets, motion);
  if (has_avx2) return move_avx2(window, grid, samples, sets, motion);
#endif
  move_any(window, grid, samples, sets, motion);
}

}  // namespace backlash::diagnosis
