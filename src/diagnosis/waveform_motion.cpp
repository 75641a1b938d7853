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

constexpr double kClosing = 1e-3;      // m/s, within which hysteresis of the teeth turns: choice
constexpr double kLeastDepth = 1e-6;   // of the usual penetration, that a power is taken of
constexpr double kStribeckSpeeds = 3;  // speeds of dry friction, at which its excess has fallen: choice
constexpr double kFast = 60;           // e^-60 is none

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

template <Teeth Law, bool Lacking>
struct Train {
  Lanes half_gap, motor_damping, dry, slow, ki, ci, per_jm, per_jp, per_jg, ko, co, contact, loss, slope;
  Lanes per_jl, link_damping, link_dry, contact_damping;
  Lanes stribeck, load_friction, drag, pinion_dry, beyond, hysteresis;
  double lever, exponent, usual_depth;
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
        stribeck(v[kStribeck]),
        load_friction(v[kLoadFriction]),
        drag(v[kDrag]),
        pinion_dry(positive(v[kPinionFriction])),
        beyond(v[kTeethExponent]),
        hysteresis(v[kTeethHysteresis]),
        lever(grid.base_radius),
        exponent(grid.exponent),
        usual_depth(grid.usual_depth),
        behind(grid.output) {}

  /// At penetration `depth` [m], approaching at `rate` [m/s]: N, no tension.
  DIAGNOSIS_LANES Lanes push(const Lanes& depth, const Lanes& rate) const {
    const Lanes times = 1 + loss * rate + hysteresis * rate / (magnitude(rate) + kClosing);
    if constexpr (Law == Teeth::hertz) return contact * depth * root(depth) * shape(depth) * positive(times);
    const Lanes spring = Law == Teeth::line ? contact * depth : contact * lanes_power(depth, exponent);
    const Lanes force = positive(spring * shape(depth) * times + contact_damping * rate);
    return depth > 0 ? force : Lanes{};
  }

  /// Of teeth of another exponent.
  DIAGNOSIS_LANES Lanes shape(const Lanes& depth) const {
    if constexpr (!Lacking) return Lanes{} + 1;
    const Lanes x = depth / usual_depth, safe = x > kLeastDepth ? x : Lanes{} + kLeastDepth;
    return lanes_exp(Lanes(beyond * lanes_log(safe)));
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
    Lanes damping = motor_damping;
    if constexpr (Lacking) damping += drag * magnitude(s.wm);
    rate.qm = s.wm, rate.wm = (drive + slope * s.qm - damping * s.wm - sensor) * per_jm;
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
    Lanes friction = dry;
    if constexpr (Lacking) {
      const Lanes x = s.wm / (kStribeckSpeeds * slow), square = x * x < kFast ? x * x : Lanes{} + kFast;
      friction = positive(dry + stribeck * lanes_exp(Lanes(-square)) +
                          load_friction * magnitude(ki * (s.qm - s.qp)));
      brake(pinion_dry * per_jp * h, h, s.qp, s.wp);
    }
    brake(friction * per_jm * h, h, s.qm, s.wm);
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
template <typename Train>
DIAGNOSIS_LANES State start(const Train& train, const WaveformWindow& window, const Lanes* v) {
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

/// A signal at the ends of the steps, with its rate.
struct Path {
  WaveformRows value, rate;
  void resize(std::size_t count) { value.resize(count), rate.resize(count); }
  DIAGNOSIS_LANES void set(std::size_t k, const Lanes& v, const Lanes& r) {
    put(v, value[k]), put(r, rate[k]);
  }

  /// After x steps, by the cubic through values and rates at either end (Hermite); beyond the ends straight
  /// on. Lines would miss some per cent of the ring.
  double at(double x, double step, std::size_t set) const {
    const int last = static_cast<int>(value.size()) - 2;
    const int k = std::clamp(static_cast<int>(std::floor(x)), 0, last);
    const auto i = static_cast<std::size_t>(k);
    const double u = x - k, p = value[i][set], q = value[i + 1][set];
    const double r = rate[i][set] * step, s = rate[i + 1][set] * step;
    if (u < 0) return p + u * r;
    if (u > 1) return q + (u - 1) * s;
    return p + u * (r + u * (3 * (q - p) - 2 * r - s + u * (2 * (p - q) + r + s)));
  }
};

/// Torque of the motor over steps one after the other, N m.
class Drive {
 public:
  DIAGNOSIS_LANES Drive(const WaveformWindow& window, double step, const Lanes* v)
      : window_(window),
        step_(step),
        delay_(v[kSwitchDelay] + v[kStartSwitch]),
        change_(window.reversal + delay_),
        follow_(step / (step + positive(v[kSwitchTime]))),
        now_(Lanes{} + window.before) {}

  DIAGNOSIS_LANES Lanes next(std::size_t k) {
    const double begin = static_cast<double>(k) * step_;
    if (window_.drive.empty()) {
      const Lanes part = (change_ - begin) / step_;
      const Lanes share = part < 0 ? Lanes{} : part > 1 ? Lanes{} + 1 : part;  // of it before the reversal
      now_ += follow_ * (share * window_.before + (1 - share) * window_.after - now_);
      return now_;
    }
    const double middle = begin + 0.5 * step_;
    while (sample_ + 2 < window_.at.size() && window_.at[sample_ + 1] <= middle) ++sample_;
    const double here = window_.drive[sample_], from = window_.at[sample_];
    const double slope = (window_.drive[sample_ + 1] - here) / (window_.at[sample_ + 1] - from);
    return here + (middle - from - delay_) * slope;
  }

 private:
  const WaveformWindow& window_;
  double step_;
  std::size_t sample_ = 0;
  Lanes delay_, change_, follow_, now_;
};

template <Teeth Law, bool Lacking>
DIAGNOSIS_LANES void move_all(const WaveformWindow& window, const WaveformGrid& grid, std::size_t samples,
                              const WaveformSets& sets, WaveformMotion& motion) {
  Lanes v[kAllValues];
  for (std::size_t k = 0; k < kAllValues; ++k)
    for (std::size_t i = 0; i < kWaveformSets; ++i) v[k][static_cast<int>(i)] = sets[k][i];
  const Train<Law, Lacking> train(v, grid);
  State s = start(train, window, v);
  const double whole = window.at[samples - 1];
  const auto steps = static_cast<std::size_t>(std::ceil(whole / grid.step));
  const double h = whole / static_cast<double>(steps);
  Drive drive(window, h, v);
  static thread_local Path torque, position;
  torque.resize(steps + 1), position.resize(steps + 1);
  const Lanes damper = grid.sensor_with_damper ? train.ci : Lanes{};
  const Lanes follow = h / (h + positive(v[kSensorTime]));  // of a step, by the sensor: implicit Euler
  const Lanes curve = v[kSensorCurve] / grid.level;
  Lanes shown = train.ki * (s.qm - s.qp) + damper * (s.wm - s.wp), shown_rate = train.ki * (s.wm - s.wp);
  for (std::size_t k = 0; k <= steps; ++k) {
    position.set(k, s.qm, s.wm);
    const Lanes bent = curve * magnitude(shown);
    torque.set(k, v[kSensorGain] * shown * (1 + bent) + v[kSensorBias],
               v[kSensorGain] * shown_rate * (1 + 2 * bent));
    if (k == steps) break;
    train.step(drive.next(k) + v[kDriveOffset], h, s);
    shown += follow * (train.ki * (s.qm - s.qp) + damper * (s.wm - s.wp) - shown);
    shown_rate += follow * (train.ki * (s.wm - s.wp) - shown_rate);
  }
  motion.torque.resize(samples), motion.position.resize(samples);
  for (std::size_t k = 0; k < samples; ++k)
    for (std::size_t i = 0; i < kWaveformSets; ++i) {
      motion.torque[k][i] = torque.at((window.at[k] - sets[kSensorLag][i]) / h, h, i);
      motion.position[k][i] =
          position.at(window.at[k] / h, h, i) + sets[kPositionZero][i] + sets[kStartZero][i];
    }
}

template <bool Lacking>
DIAGNOSIS_LANES void move_any(const WaveformWindow& window, const WaveformGrid& grid, std::size_t samples,
                              const WaveformSets& sets, WaveformMotion& motion) {
  if (grid.exponent == kHertzExponent)
    return move_all<Teeth::hertz, Lacking>(window, grid, samples, sets, motion);
  if (grid.exponent == 1) return move_all<Teeth::line, Lacking>(window, grid, samples, sets, motion);
  move_all<Teeth::power, Lacking>(window, grid, samples, sets, motion);
}

DIAGNOSIS_LANES void move_either(const WaveformWindow& window, const WaveformGrid& grid, std::size_t samples,
                                 bool lacking, const WaveformSets& sets, WaveformMotion& motion) {
  if (lacking)
    move_any<true>(window, grid, samples, sets, motion);
  else
    move_any<false>(window, grid, samples, sets, motion);
}

#if defined(__x86_64__)
__attribute__((target("avx512f,prefer-vector-width=512"))) void move_avx512(const WaveformWindow& window,
                                                                            const WaveformGrid& grid,
                                                                            std::size_t samples, bool lacking,
                                                                            const WaveformSets& sets,
                                                                            WaveformMotion& motion) {
  move_either(window, grid, samples, lacking, sets, motion);
}

__attribute__((target("avx2"))) void move_avx2(const WaveformWindow& window, const WaveformGrid& grid,
                                               std::size_t samples, bool lacking, const WaveformSets& sets,
                                               WaveformMotion& motion) {
  move_either(window, grid, samples, lacking, sets, motion);
}
#endif

}  // namespace

void move_waveform(const WaveformWindow& window, const WaveformGrid& grid, std::size_t samples, bool lacking,
                   const WaveformSets& sets, WaveformMotion& motion) {
#if defined(__x86_64__)
  static const bool has_avx512 = __builtin_cpu_supports("avx512f");
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx512) return move_avx512(window, grid, samples, lacking, sets, motion);
  if (has_avx2) return move_avx2(window, grid, samples, lacking, sets, motion);
#endif
  move_either(window, grid, samples, lacking, sets, motion);
}

}  // namespace backlash::diagnosis
