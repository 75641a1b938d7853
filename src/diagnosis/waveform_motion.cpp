// SPDX-License-Identifier: BSD-3-Clause
#include "waveform_motion.h"

#include <algorithm>
#include <cmath>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace backlash::diagnosis {
namespace {

using Lanes = double __attribute__((vector_size(8 * kWaveformSets)));
#define WAVEFORM_INLINE inline __attribute__((always_inline))

constexpr double kRateTime = 1e-3;    // s, of the start values that are rates: choice
constexpr double kSaturated = 4.9;    // -, where the fraction below reaches 1
constexpr double kStiffestBrake = 2;  // -, friction within one step: the method is stable to 2.78

WAVEFORM_INLINE Lanes positive(const Lanes& a) {
  return a > 0 ? a : Lanes{};
}
WAVEFORM_INLINE Lanes magnitude(const Lanes& a) {
  return a < 0 ? -a : a;
}
WAVEFORM_INLINE Lanes root(const Lanes& a) {
  Lanes r = a;
#if defined(__SSE2__)  // in a loop compilers make a call of sqrt()
  for (int i = 0; i < kWaveformSets; i += 2) {
    const __m128d pair = _mm_sqrt_pd(__m128d{a[i], a[i + 1]});
    r[i] = pair[0], r[i + 1] = pair[1];
  }
#else
  for (int i = 0; i < kWaveformSets; ++i) r[i] = std::sqrt(r[i]);
#endif
  return r;
}

/// tanh to 1e-4 by its continued fraction (Lambert).
WAVEFORM_INLINE Lanes soft_sign(const Lanes& a) {
  const Lanes end = Lanes{} + kSaturated;
  const Lanes x = a > end ? end : a < -end ? -end : a;
  const Lanes s = x * x;
  return x * (135135 + s * (17325 + s * (378 + s))) / (135135 + s * (62370 + s * (3150 + s * 28)));
}

struct State {
  Lanes qm, wm, qp, wp, qg, wg;
};

struct Train {
  Lanes half_gap, motor_damping, dry, per_speed, ki, ci, per_jm, per_jp, per_jg, ko, co, contact, loss, slope;
  double lever;

  explicit Train(const Lanes* v, const WaveformGrid& grid)
      : half_gap(v[kHalfGap]),
        motor_damping(v[kMotorDamping]),
        dry(positive(v[kDryFriction])),
        ki(v[kSensorStiffness]),
        ci(v[kSensorDamping]),
        per_jm(1 / v[kMotorInertia]),
        per_jp(1 / v[kPinionInertia]),
        per_jg(1 / v[kGearInertia]),
        ko(v[kOutputStiffness]),
        co(v[kOutputDamping]),
        contact(v[kContactStiffness]),
        loss(1.5 * v[kContactLoss]),
        slope(v[kDriveSlope]),
        lever(grid.base_radius) {
    const Lanes slowest = dry * per_jm * (grid.interval / grid.steps / kStiffestBrake);
    per_speed = 1 / (v[kFrictionSpeed] > slowest ? v[kFrictionSpeed] : slowest);
  }

  WAVEFORM_INLINE State rate(const State& s, const Lanes& drive) const {
    const Lanes x = lever * (s.qp - s.qg), v = lever * (s.wp - s.wg);
    const Lanes depth = positive(magnitude(x) - half_gap);
    const Lanes push = lever * contact * depth * root(depth) * positive(1 + loss * (x < 0 ? -v : v));
    const Lanes teeth = x < 0 ? -push : push;
    const Lanes sensor = ki * (s.qm - s.qp) + ci * (s.wm - s.wp);
    const Lanes brake = motor_damping * s.wm + dry * soft_sign(s.wm * per_speed);
    return {s.wm, (drive + slope * s.qm - brake - sensor) * per_jm, s.wp, (sensor - teeth) * per_jp,
            s.wg, (teeth - ko * s.qg - co * s.wg) * per_jg};
  }
};

WAVEFORM_INLINE State along(const State& s, const State& r, double h) {
  return {s.qm + h * r.qm, s.wm + h * r.wm, s.qp + h * r.qp,
          s.wp + h * r.wp, s.qg + h * r.qg, s.wg + h * r.wg};
}

WAVEFORM_INLINE void step(const Train& train, const Lanes& drive, double h, State& s) {
  const State a = train.rate(s, drive), b = train.rate(along(s, a, h / 2), drive);
  const State c = train.rate(along(s, b, h / 2), drive), d = train.rate(along(s, c, h), drive);
  s = along(along(along(along(s, a, h / 6), b, h / 3), c, h / 3), d, h / 6);
}

/// The gear follows the pinion on its flank: 5 ms before a reversal nothing else moves.
State start(const Train& train, const WaveformWindow& window, const Lanes* v) {
  const Lanes load = positive(v[kStartFlank]);
  Lanes depth = {}, share = {};
  for (int i = 0; i < kWaveformSets; ++i) {
    if (!(load[i] > 0)) continue;
    const double force = load[i] / train.lever;
    depth[i] = std::cbrt(force / train.contact[i] * force / train.contact[i]);
    const double stiffness = 1.5 * train.contact[i] * std::sqrt(depth[i]) * train.lever * train.lever;
    share[i] = stiffness / (stiffness + train.ko[i]);
  }
  const Lanes off = v[kStartFlank] < 0 ? v[kStartFlank] / train.ki : Lanes{};
  State s;
  s.qg = window.side * load / train.ko;
  s.qp = s.qg + window.side * ((train.half_gap + depth) / train.lever + off);
  s.qm = s.qp + window.side * v[kStartTwist] / train.ki;
  s.wp = window.side * v[kStartPinionRate] / (kRateTime * train.ki);
  s.wm = s.wp + window.side * v[kStartTwistRate] / (kRateTime * train.ki);
  s.wg = s.wp * share;
  return s;
}

void put(const Lanes& from, std::array<double, kWaveformSets>& to) {
  for (int i = 0; i < kWaveformSets; ++i) to[static_cast<std::size_t>(i)] = from[i];
}

/// Torque `lag` ago, by the cubic through values and rates at either end of the interval (Hermite).
double lagged(const std::vector<Lanes>& torque, const std::vector<Lanes>& rate, int sample, int set,
              double lag, double interval) {
  const double x = sample - lag / interval;
  const int last = static_cast<int>(torque.size()) - 2;
  const int k = std::clamp(static_cast<int>(std::floor(x)), 0, last);
  const std::size_t i = static_cast<std::size_t>(k);
  const double u = x - k, p = torque[i][set], q = torque[i + 1][set];
  const double r = rate[i][set] * interval, s = rate[i + 1][set] * interval;
  return p + u * (r + u * (3 * (q - p) - 2 * r - s + u * (2 * (p - q) + r + s)));
}

WAVEFORM_INLINE void move_all(const WaveformWindow& window, const WaveformGrid& grid, int samples,
                              const WaveformSets& sets, WaveformMotion& motion) {
  Lanes v[kAllValues];
  for (std::size_t k = 0; k < kAllValues; ++k)
    for (std::size_t i = 0; i < kWaveformSets; ++i) v[k][static_cast<int>(i)] = sets[k][i];
  const Train train(v, grid);
  State s = start(train, window, v);
  const double h = grid.interval / grid.steps;
  const Lanes change = window.reversal + v[kSwitchDelay];
  const auto count = static_cast<std::size_t>(samples);
  static thread_local std::vector<Lanes> torque, rate;
  torque.resize(count), rate.resize(count);
  motion.torque.resize(count), motion.position.resize(count);
  const Lanes damper = grid.sensor_with_damper ? train.ci : Lanes{};
  const Lanes follow = h / (h + positive(v[kSensorTime]));  // of a step, by the sensor: implicit Euler
  Lanes shown = train.ki * (s.qm - s.qp) + damper * (s.wm - s.wp), shown_rate = train.ki * (s.wm - s.wp);
  for (std::size_t k = 0; k < count; ++k) {
    torque[k] = v[kSensorGain] * shown + v[kSensorBias];
    rate[k] = v[kSensorGain] * shown_rate;
    put(s.qm + v[kPositionZero], motion.position[k]);
    if (k + 1 == count) break;
    for (int j = 0; j < grid.steps; ++j) {
      const Lanes part =
          (change - (static_cast<double>(k) * grid.interval + j * h)) / h;  // before the reversal
      const Lanes share = part < 0 ? Lanes{} : part > 1 ? Lanes{} + 1 : part;
      step(train, share * window.before + (1 - share) * window.after + v[kDriveOffset], h, s);
      shown += follow * (train.ki * (s.qm - s.qp) + damper * (s.wm - s.wp) - shown);
      shown_rate += follow * (train.ki * (s.wm - s.wp) - shown_rate);
    }
  }
  for (std::size_t k = 0; k < count; ++k)
    for (std::size_t i = 0; i < kWaveformSets; ++i)
      motion.torque[k][i] =
          lagged(torque, rate, static_cast<int>(k), static_cast<int>(i), sets[kSensorLag][i], grid.interval);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) void move_avx2(const WaveformWindow& window, const WaveformGrid& grid,
                                               int samples, const WaveformSets& sets,
                                               WaveformMotion& motion) {
  move_all(window, grid, samples, sets, motion);
}
#endif

}  // namespace

void move_waveform(const WaveformWindow& window, const WaveformGrid& grid, int samples,
                   const WaveformSets& sets, WaveformMotion& motion) {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx2) return move_avx2(window, grid, samples, sets, motion);
#endif
  move_all(window, grid, samples, sets, motion);
}

}  // namespace backlash::diagnosis
