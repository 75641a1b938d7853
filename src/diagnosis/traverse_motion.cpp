// SPDX-License-Identifier: BSD-3-Clause
#include "traverse_motion.h"

#include <algorithm>
#include <cmath>

#include "lanes_power.h"

namespace backlash::diagnosis {
namespace {

// Deflections, in those under the usual torque, and powers beyond which no fit comes: they keep lanes_exp()
// within its range.
constexpr double kLeastDeflection = 1e-30, kMostDeflection = 1e30, kMostPower = 10;

template <typename Lanes>
constexpr int kLanesOf = static_cast<int>(sizeof(Lanes) / sizeof(double));

/// Motor between two samples at share u of the interval, a cubic through positions and rates: what their
/// differences, and the rates at either end, count there.
struct CubicWeights {
  double position_step, position_begin, position_end;  // -, s, s
  double rate_step, rate_begin, rate_end;              // 1/s, -, -

  CubicWeights(double u, double interval)
      : position_step(u * u * (3 - 2 * u)),
        position_begin(u * (1 - u) * (1 - u) * interval),
        position_end(u * u * (u - 1) * interval),
        rate_step(6 * u * (1 - u) / interval),
        rate_begin((3 * u - 1) * (u - 1)),
        rate_end(u * (3 * u - 2)) {}
};

template <typename Lanes>
struct Place {
  Lanes position, rate;
};

/// How deep the teeth are pressed, how fast more so, and the sign bit of the flank.
template <typename Lanes>
struct Touch {
  Lanes depth, rate;
  LaneBits<Lanes> side;
};

template <typename Lanes>
DIAGNOSIS_LANES Lanes turned(const Lanes& a, const LaneBits<Lanes>& sign) {
  const LaneBits<Lanes> bits = reinterpret_cast<LaneBits<Lanes>>(a) ^ sign;
  return reinterpret_cast<Lanes>(bits);
}

/// Of some runs side by side. The teeth yield as a spring does at the usual torque, and by a power of it
/// elsewhere. Damping follows: constant for a spring and as the torque after Hertz (Hunt and Crossley 1975),
/// between them by 3 (power - 1).
template <typename Lanes>
struct Machines {
  Lanes half_gap, stiffness, damping, beyond_spring, per_deflection, per_inertia, friction, load_torque,
      per_slow;

  DIAGNOSIS_LANES Touch<Lanes> touch(const Place<Lanes>& motor, const Place<Lanes>& load) const {
    const Lanes x = motor.position - load.position;
    const LaneBits<Lanes> side = reinterpret_cast<LaneBits<Lanes>>(x) & INT64_MIN;
    return {turned(x, side) - half_gap, turned(Lanes(motor.rate - load.rate), side), side};
  }

  /// Through the teeth, never tensile.
  DIAGNOSIS_LANES Lanes torque(const Touch<Lanes>& touch) const {
    const Lanes deflection = touch.depth * per_deflection;
    const Lanes not_less = deflection > kLeastDeflection ? deflection : Lanes{} + kLeastDeflection;
    const Lanes within = not_less < kMostDeflection ? not_less : Lanes{} + kMostDeflection;
    const Lanes harder = lanes_exp(Lanes(beyond_spring * lanes_log(within)));
    const Lanes damper = beyond_spring > 0 ? damping * harder * harder * harder : damping;
    const Lanes force = stiffness * touch.depth * harder + damper * touch.rate;
    const Lanes pushed = force > 0 ? force : Lanes{};
    return turned(touch.depth > 0 ? pushed : Lanes{}, touch.side);
  }

  /// Of the load, rad/s^2.
  DIAGNOSIS_LANES Lanes acceleration(const Lanes& teeth, const Lanes& rate) const {
    const Lanes slip = rate * per_slow, most = slip < 1 ? slip : Lanes{} + 1,
                share = most > -1 ? most : Lanes{} - 1;
    return (teeth - load_torque - friction * share) * per_inertia;
  }
};

template <typename Lanes>
DIAGNOSIS_LANES Machines<Lanes> machines_of(const TraverseData& data, const TraverseRun* const* runs) {
  Machines<Lanes> to;
  to.per_slow = Lanes{} + 1 / data.slow;
  for (int i = 0; i < kLanesOf<Lanes>; ++i) {
    const TraverseMachine& m = runs[i]->machine;
    to.half_gap[i] = 0.5 * m[kTraverseGap];
    to.stiffness[i] = m[kTraverseStiffness];
    to.damping[i] = m[kTraverseDamping];
    to.beyond_spring[i] = std::min(m[kTraversePower], kMostPower) - 1;
    to.per_deflection[i] = m[kTraverseStiffness] / data.level;
    to.per_inertia[i] = 1 / m[kTraverseLoadInertia];
    to.friction[i] = m[kTraverseLoadFriction];
    to.load_torque[i] = runs[i]->own[kOwnLoadTorque];
  }
  return to;
}

/// The load as far behind the motor as the torque through the teeth at the first sample says.
Place<double> start_of(const TraverseData& data, const TraverseRun& run) {
  const TraverseWindow& w = *run.window;
  const double stiffness = run.machine[kTraverseStiffness], power = run.machine[kTraversePower],
               torque = std::fabs(w.torque);
  const double in = data.level / stiffness * std::pow(torque / data.level, 1 / power);
  return {data.position[w.first] - w.side * (0.5 * run.machine[kTraverseGap] + in) + run.own[kOwnPosition],
          data.rate[w.first] - in * w.torque_rate / (power * torque) + run.own[kOwnRate]};
}

/// Loads of some runs, moved by the classical Runge-Kutta method, its stages one by one: the compiler mixes
/// those of several of these, so that the processor need not wait.
template <typename Lanes>
class alignas(sizeof(Lanes)) Loads {
 public:
  DIAGNOSIS_LANES void start(const TraverseData& data, const TraverseRun* const* runs) {
    machines_ = machines_of<Lanes>(data, runs);
    for (int i = 0; i < kLanesOf<Lanes>; ++i) {
      const std::size_t first = runs[i]->window->first;
      const Place<double> place = start_of(data, *runs[i]);
      load_.position[i] = place.position, load_.rate[i] = place.rate;
      next_.position[i] = data.position[first], next_.rate[i] = data.rate[first];
      positions_[i] = data.position.data() + first, rates_[i] = data.rate.data() + first;
    }
    trial_ = load_;
  }

  /// To the interval from sample k to the next.
  DIAGNOSIS_LANES void begin(std::size_t k) {
    here_ = motor_ = next_;
    for (int i = 0; i < kLanesOf<Lanes>; ++i)
      next_.position[i] = positions_[i][k + 1], next_.rate[i] = rates_[i][k + 1];
    step_ = next_.position - here_.position;
    mean_ = mean_of_next_, mean_of_next_ = Lanes{};
  }

  DIAGNOSIS_LANES void move_motor(const CubicWeights& w) {
    motor_.position = here_.position + w.position_step * step_ + w.position_begin * here_.rate +
                      w.position_end * next_.rate;
    motor_.rate = w.rate_step * step_ + w.rate_begin * here_.rate + w.rate_end * next_.rate;
  }

  /// At the place of this stage: which are pressed.
  DIAGNOSIS_LANES LaneBits<Lanes> touch() {
    touch_ = machines_.touch(motor_, trial_);
    return touch_.depth > 0;
  }
  DIAGNOSIS_LANES void press() { teeth_ = machines_.torque(touch_); }
  DIAGNOSIS_LANES void leave() { teeth_ = Lanes{}; }

  /// `before`, `after`: how the torque here counts in the means about sample k and the next.
  DIAGNOSIS_LANES void first_stage(double half, double before, double after) {
    mean_ += before * teeth_, mean_of_next_ += after * teeth_;
    sum_ = Place<Lanes>{};
    stage(1, half);
  }

  /// Counts `weight` times; the next is `on` later than the first.
  DIAGNOSIS_LANES void stage(double weight, double on) {
    const Lanes rate = trial_.rate, acceleration = machines_.acceleration(teeth_, rate);
    sum_.position += weight * rate, sum_.rate += weight * acceleration;
    trial_ = {load_.position + on * rate, load_.rate + on * acceleration};
  }

  DIAGNOSIS_LANES void last_stage(double sixth) {
    sum_.position += trial_.rate, sum_.rate += machines_.acceleration(teeth_, trial_.rate);
    load_.position += sixth * sum_.position, load_.rate += sixth * sum_.rate;
    trial_ = load_;
  }

  /// About sample k.
  DIAGNOSIS_LANES double mean(int lane) const { return mean_[lane]; }

 private:
  Machines<Lanes> machines_;
  Place<Lanes> here_, next_, motor_, load_, trial_, sum_;
  Touch<Lanes> touch_;
  Lanes teeth_, step_, mean_, mean_of_next_ = {};
  const double *positions_[kLanesOf<Lanes>], *rates_[kLanesOf<Lanes>];  // of the motor
};

/// The torque of a stage. Half of the time no teeth are pressed, and powers take most of the time.
template <typename Lanes, int Parts>
DIAGNOSIS_LANES void press(Loads<Lanes> (&parts)[Parts]) {
  LaneBits<Lanes> pressed = {};
  for (Loads<Lanes>& part : parts) pressed |= part.touch();
  bool any = false;
  for (int i = 0; i < kLanesOf<Lanes>; ++i) any |= pressed[i] != 0;
  if (any)
    for (Loads<Lanes>& part : parts) part.press();
  else
    for (Loads<Lanes>& part : parts) part.leave();
}

/// Moves kTraverseRuns, of which the first `count` are wanted. `weights`: of each half step of the
/// integration.
template <typename Lanes>
DIAGNOSIS_LANES void move_all(const TraverseData& data, const CubicWeights* weights,
                              const TraverseRun* const* runs, Eigen::Index count, double* to) {
  constexpr int kLanes = kLanesOf<Lanes>, kParts = kTraverseRuns / kLanes;
  Loads<Lanes> parts[kParts];
  for (int p = 0; p < kParts; ++p) parts[p].start(data, runs + p * kLanes);
  const double step = data.interval / data.steps, share = 1.0 / data.steps;
  for (std::size_t k = 0; k + 1 < data.samples; ++k) {
    for (Loads<Lanes>& part : parts) part.begin(k);
    for (int s = 0; s < data.steps; ++s) {
      const double after = s * share * share;
      press(parts);
      for (Loads<Lanes>& part : parts) part.first_stage(step / 2, share - after, after);
      for (Loads<Lanes>& part : parts) part.move_motor(weights[2 * s]);
      press(parts);
      for (Loads<Lanes>& part : parts) part.stage(2, step / 2);
      press(parts);
      for (Loads<Lanes>& part : parts) part.stage(2, step);
      for (Loads<Lanes>& part : parts) part.move_motor(weights[2 * s + 1]);
      press(parts);
      for (Loads<Lanes>& part : parts) part.last_stage(step / 6);
    }
    for (int i = 0; i < count; ++i)
      to[static_cast<std::size_t>(i) * data.samples + k] = parts[i / kLanes].mean(i % kLanes);
  }
}

using Lanes2 = double __attribute__((vector_size(16)));

#if defined(__x86_64__)
using Lanes4 = double __attribute__((vector_size(32)));
using Lanes8 = double __attribute__((vector_size(64)));

__attribute__((target("avx512f,prefer-vector-width=512"))) void move_avx512(const TraverseData& data,
                                                                            const CubicWeights* weights,
                                                                            const TraverseRun* const* runs,
                                                                            Eigen::Index count, double* to) {
  move_all<Lanes8>(data, weights, runs, count, to);
}

__attribute__((target("avx2"))) void move_avx2(const TraverseData& data, const CubicWeights* weights,
                                               const TraverseRun* const* runs, Eigen::Index count,
                                               double* to) {
  move_all<Lanes4>(data, weights, runs, count, to);
}
#endif

void move(const TraverseData& data, const CubicWeights* weights, const TraverseRun* const* runs,
          Eigen::Index count, double* to) {
#if defined(__x86_64__)
  static const bool has_avx512 = __builtin_cpu_supports("avx512f");
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx512) return move_avx512(data, weights, runs, count, to);
  if (has_avx2) return move_avx2(data, weights, runs, count, to);
#endif
  move_all<Lanes2>(data, weights, runs, count, to);
}

}  // namespace

bool moves_load(int value) {
  switch (value) {
    case kTraverseMotorInertia:
    case kTraverseMotorDamping:
    case kTraverseMotorFriction:
    case kTraverseEarlier:
    case kTraverseValues + kOwnMotorTorque:
      return false;
    default:
      return true;
  }
}

Eigen::MatrixXd traverse_teeth(const TraverseData& data, const std::vector<TraverseRun>& runs) {
  std::vector<CubicWeights> weights;
  for (int half = 1; half <= 2 * data.steps; ++half)
    weights.emplace_back(half / (2.0 * data.steps), data.interval);
  const auto all = static_cast<Eigen::Index>(runs.size());
  Eigen::MatrixXd teeth = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(data.samples), all);
  for (Eigen::Index first = 0; first < all; first += kTraverseRuns) {
    const Eigen::Index count = std::min<Eigen::Index>(kTraverseRuns, all - first);
    const TraverseRun* group[kTraverseRuns];
    for (Eigen::Index i = 0; i < kTraverseRuns; ++i)
      group[i] = &runs[static_cast<std::size_t>(first + std::min(i, count - 1))];
    move(data, weights.data(), group, count, teeth.col(first).data());
  }
  return teeth;
}

Eigen::VectorXd traverse_residual(const TraverseData& data, const TraverseRun& run,
                                  const Eigen::Ref<const Eigen::VectorXd>& teeth) {
  const TraverseMachine& m = run.machine;
  Eigen::VectorXd left = Eigen::VectorXd::Zero(teeth.size());
  for (Eigen::Index k = 1; k + 1 < left.size(); ++k) {
    const std::size_t i = run.window->first + static_cast<std::size_t>(k);
    if (!data.counts[i]) continue;
    const double drive =
        (1 - m[kTraverseEarlier]) * data.torque[i] + m[kTraverseEarlier] * data.torque[i - 1];
    left[k] = drive - (teeth[k] + run.own[kOwnMotorTorque] + m[kTraverseMotorInertia] * data.acceleration[i] +
                       m[kTraverseMotorDamping] * data.rate[i] +
                       std::copysign(m[kTraverseMotorFriction], data.rate[i]));
  }
  return left;
}

}  // namespace backlash::diagnosis
