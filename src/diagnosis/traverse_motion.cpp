// SPDX-License-Identifier: BSD-3-Clause
#include "traverse_motion.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/root_in_step.h"
#include "lanes_power.h"

namespace backlash::diagnosis {
double shown_too_much(const TraverseData& data, const TraverseRun& run, std::size_t sample) {
  return run.own[kOwnShown] + run.machine[kTraverseZero] + run.machine[kTraverseSine] * data.sine[sample] +
         run.machine[kTraverseCosine] * data.cosine[sample];
}

namespace {

// Deflections, in those under the usual torque, between which stiffness and damping follow powers. Where
// teeth touch the deflection is what rounding has left, and a small power of that, of a damper, a random
// number: the motion would jump from machine to machine, and no fit could follow. Beyond, no teeth go, but
// fits that begin far away, whose steps would not be stable there. And powers beyond which no fit comes.
constexpr double kLeastDeflection = 1e-6, kMostDeflection = 10, kMostPower = 10;

template <typename Lanes>
constexpr int kLanesOf = static_cast<int>(sizeof(Lanes) / sizeof(double));

/// Of a cubic through two places, `interval` apart, with rates there, at share u of the way: what their
/// difference and the rates at either end count. A number for all lanes, or one for each.
template <typename T>
struct CubicWeights {
  T position_step, position_begin, position_end;  // -, s, s
  T rate_step, rate_begin, rate_end;              // 1/s, -, -

  DIAGNOSIS_LANES CubicWeights(const T& u, double interval)
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

/// Of some runs side by side. Teeth and dampers are as declared at the usual torque, and follow powers of the
/// deflection elsewhere.
template <typename Lanes>
struct Machines {
  Lanes half_gap, stiffness, damping, damping_power, beyond_spring, hardening, per_hardened, per_deflection,
      per_inertia, friction, viscous, load_torque, per_slow;

  DIAGNOSIS_LANES Touch<Lanes> touch(const Place<Lanes>& motor, const Place<Lanes>& load) const {
    const Lanes x = motor.position - load.position;
    const LaneBits<Lanes> side = reinterpret_cast<LaneBits<Lanes>>(x) & INT64_MIN;
    return {turned(x, side) - half_gap, turned(Lanes(motor.rate - load.rate), side), side};
  }

  /// Through teeth that are pressed; where they would pull they have come apart. On the other side of no
  /// deflection it goes on smoothly, for the steps that come there.
  DIAGNOSIS_LANES Lanes torque(const Touch<Lanes>& touch) const {
    const Lanes deflection = (touch.depth > 0 ? touch.depth : -touch.depth) * per_deflection;
    const Lanes not_less = deflection > kLeastDeflection ? deflection : Lanes{} + kLeastDeflection;
    const Lanes within = not_less < kMostDeflection ? not_less : Lanes{} + kMostDeflection;
    const Lanes log = lanes_log(within);
    const Lanes harder =
        lanes_exp(Lanes(beyond_spring * log)) * (1 + hardening * within * within) * per_hardened;
    const Lanes damper = damping * lanes_exp(Lanes(damping_power * log));
    return stiffness * touch.depth * harder + damper * touch.rate;
  }

  /// Of the load, rad/s^2.
  DIAGNOSIS_LANES Lanes acceleration(const Lanes& teeth, const Lanes& rate) const {
    const Lanes slip = rate * per_slow, most = slip < 1 ? slip : Lanes{} + 1,
                share = most > -1 ? most : Lanes{} - 1;
    return (teeth - load_torque - viscous * rate - friction * share) * per_inertia;
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
    to.damping_power[i] = std::min(m[kTraverseDampingPower], kMostPower);
    to.hardening[i] = m[kTraverseHardening], to.per_hardened[i] = 1 / (1 + m[kTraverseHardening]);
    to.per_deflection[i] = m[kTraverseStiffness] / data.level;
    to.per_inertia[i] = 1 / m[kTraverseLoadInertia];
    to.friction[i] = m[kTraverseLoadFriction], to.viscous[i] = m[kTraverseLoadDamping];
    to.load_torque[i] = runs[i]->own[kOwnLoadTorque] + m[kTraverseLoadTerms] * runs[i]->window->load_torque;
  }
  return to;
}

/// Where the load's encoder shows it; without one as far behind the motor as the torque through the teeth at
/// the first sample says.
Place<double> start_of(const TraverseData& data, const TraverseRun& run) {
  const TraverseWindow& w = *run.window;
  if (!data.load.empty()) {
    const double rate = w.load_rate + run.own[kOwnRate];
    return {w.load + run.machine[kTraverseSkew] * rate - shown_too_much(data, run, w.first) +
                run.own[kOwnPosition],
            rate};
  }
  const double stiffness = run.machine[kTraverseStiffness], power = run.machine[kTraversePower],
               torque = std::fabs(w.torque);
  const double in = data.level / stiffness * std::pow(torque / data.level, 1 / power);
  return {data.position[w.first] - w.side * (0.5 * run.machine[kTraverseGap] + in) + run.own[kOwnPosition],
          data.rate[w.first] - in * w.torque_rate / (power * torque) + run.own[kOwnRate]};
}

template <typename Flags>
DIAGNOSIS_LANES bool any(const Flags& flags) {
  bool found = false;
  for (std::size_t i = 0; i < sizeof(Flags) / sizeof(double); ++i) found |= flags[i] != 0;
  return found;
}

/// A step of an interval from share `from` to `to` of it. What the torque of its stages counts in the means
/// about the samples at both ends: 1 - u and u at share u, by Simpson's rule, which is that of the stages. A
/// number for all lanes, or one for each.
template <typename T>
struct Step {
  CubicWeights<T> half, end;
  T length;               // s
  T before[3], after[3];  // at its begin, at each of both stages in the middle, and at its end

  DIAGNOSIS_LANES Step(const T& from, const T& to, double interval)
      : half(T(0.5 * (from + to)), interval), end(to, interval), length((to - from) * interval) {
    const T sixth = (to - from) / 6, middle = 0.5 * (from + to);
    before[0] = sixth * (1 - from), after[0] = sixth * from;
    before[1] = 2 * sixth * (1 - middle), after[1] = 2 * sixth * middle;
    before[2] = sixth * (1 - to), after[2] = sixth * to;
  }
};

/// Loads of some runs, moved by the classical Runge-Kutta method, its stages one by one: the compiler mixes
/// those of several of these, so that the processor need not wait.
///
/// Teeth are pressed, or not, from the begin of a step to its end. Where that ends within the step, as those
/// that are apart touch or those that are pressed would pull, the step is taken again up to there, and on
/// from there in the other way. Damped teeth push at once when they touch: a step across that would be wrong
/// by as much as it is long, and differently for each value of the machine, which no fit can follow.
template <typename Lanes>
class alignas(sizeof(Lanes)) Loads {
 public:
  using Flags = LaneBits<Lanes>;

  DIAGNOSIS_LANES void start(const TraverseData& data, const TraverseRun* const* runs) {
    machines_ = machines_of<Lanes>(data, runs);
    for (int i = 0; i < kLanesOf<Lanes>; ++i) {
      const std::size_t first = runs[i]->window->first;
      const Place<double> place = start_of(data, *runs[i]);
      load_.position[i] = place.position, load_.rate[i] = place.rate;
      next_.position[i] = data.position[first], next_.rate[i] = data.rate[first];
      positions_[i] = data.position.data() + first, rates_[i] = data.rate.data() + first;
    }
    motor_ = next_, trial_ = load_;
    touch_ = machines_.touch(motor_, trial_);
    force_ = machines_.torque(touch_);
    pressed_ = (touch_.depth > 0) & (force_ > 0);
    teeth_ = pressed_ ? turned(force_, touch_.side) : Lanes{};
  }

  /// To the interval from sample k to the next.
  DIAGNOSIS_LANES void begin(std::size_t k) {
    here_ = next_;
    for (int i = 0; i < kLanesOf<Lanes>; ++i)
      next_.position[i] = positions_[i][k + 1], next_.rate[i] = rates_[i][k + 1];
    step_ = next_.position - here_.position;
    mean_ = mean_of_next_, mean_of_next_ = Lanes{};
  }

  template <typename T>
  DIAGNOSIS_LANES void move_motor(const CubicWeights<T>& w) {
    motor_.position = here_.position + w.position_step * step_ + w.position_begin * here_.rate +
                      w.position_end * next_.rate;
    motor_.rate = w.rate_step * step_ + w.rate_begin * here_.rate + w.rate_end * next_.rate;
  }

  DIAGNOSIS_LANES Flags pressed() const { return pressed_; }
  /// The torque at the place of this stage; where none is pressed none is asked for.
  DIAGNOSIS_LANES void press() {
    touch_ = machines_.touch(motor_, trial_);
    force_ = machines_.torque(touch_);
    teeth_ = pressed_ ? turned(force_, touch_.side) : Lanes{};
  }
  DIAGNOSIS_LANES void leave() { teeth_ = Lanes{}; }

  template <typename T>
  DIAGNOSIS_LANES void first_stage(const Step<T>& s) {
    sum_ = Place<Lanes>{}, sum_before_ = sum_after_ = Lanes{};
    stage<T>(1, s.length / 2, s.before[0], s.after[0]);
  }
  /// The rates count `weight` times, and the next stage is `on` later than the first.
  template <typename T>
  DIAGNOSIS_LANES void stage(double weight, const T& on, const T& before, const T& after) {
    const Lanes rate = trial_.rate, acceleration = machines_.acceleration(teeth_, rate);
    sum_.position += weight * rate, sum_.rate += weight * acceleration;
    sum_before_ += before * teeth_, sum_after_ += after * teeth_;
    middle_ = force_;  // after the third
    trial_ = {load_.position + on * rate, load_.rate + on * acceleration};
  }
  template <typename T>
  DIAGNOSIS_LANES void last_stage(const Step<T>& s) {
    const Lanes middle = middle_;
    stage<T>(1, s.length, s.before[2], s.after[2]);
    middle_ = middle;
    load_.position += s.length / 6 * sum_.position, load_.rate += s.length / 6 * sum_.rate;
    trial_ = load_;
    touch_ = machines_.touch(motor_, load_);
  }

  /// Which may be pressed where the step has come to.
  DIAGNOSIS_LANES Flags may_press() const { return pressed_ | (touch_.depth > 0); }
  /// Which have come to touch or to leave in the step.
  DIAGNOSIS_LANES Flags changed() {
    force_ = machines_.torque(touch_);
    return changed_ = pressed_ ^ ((touch_.depth > 0) & (force_ > 0));
  }
  DIAGNOSIS_LANES void keep_begin() { begin_ = {load_, touch_, force_, teeth_}; }
  DIAGNOSIS_LANES void end_step() {
    mean_ += sum_before_, mean_of_next_ += sum_after_;
    teeth_ = pressed_ ? turned(force_, touch_.side) : Lanes{};
  }

  /// Back to the begin of the step. Returns the share of it, `step` long, after which they touch or leave.
  DIAGNOSIS_LANES Lanes go_back(double step) {
    const Lanes share = share_of_change(step);
    end_ = {load_, motor_, sum_before_, sum_after_};
    load_ = trial_ = begin_.load, touch_ = begin_.touch, force_ = begin_.force, teeth_ = begin_.teeth;
    return share;
  }
  /// At the place where they touch or leave.
  DIAGNOSIS_LANES void change() {
    first_before_ = sum_before_, first_after_ = sum_after_;
    pressed_ ^= changed_;
    press();
  }
  /// At the end of the step; those that did not change are as they were there.
  DIAGNOSIS_LANES void end_change() {
    load_.position = changed_ ? load_.position : end_.load.position;
    load_.rate = changed_ ? load_.rate : end_.load.rate;
    sum_before_ = changed_ ? first_before_ + sum_before_ : end_.sum_before;
    sum_after_ = changed_ ? first_after_ + sum_after_ : end_.sum_after;
    trial_ = load_, motor_ = end_.motor;
    touch_ = machines_.touch(motor_, load_);
    force_ = machines_.torque(touch_);
  }

  /// About sample k.
  DIAGNOSIS_LANES double mean(int lane) const { return mean_[lane]; }
  DIAGNOSIS_LANES double position(int lane) const { return load_.position[lane]; }
  DIAGNOSIS_LANES double rate(int lane) const { return load_.rate[lane]; }

 private:
  /// Of those that are apart the depth comes to 0, of those that are pressed the torque.
  DIAGNOSIS_LANES Lanes share_of_change(double step) const {
    const Flags other = begin_.touch.side ^ touch_.side;  // they come from beyond the middle of the gap
    const Lanes depth = other ? -2 * machines_.half_gap - begin_.touch.depth : begin_.touch.depth,
                grows = step * turned(begin_.touch.rate, other), grows_last = step * touch_.rate,
                touches = signal::root_by_slopes<Lanes>(depth, touch_.depth, grows, grows_last),
                leaves = signal::root_by_middle<Lanes>(-begin_.force, -middle_, -force_);
    return pressed_ ? leaves : touches;
  }

  struct Begin {  // of a step
    Place<Lanes> load;
    Touch<Lanes> touch;
    Lanes force, teeth;
  };
  struct End {
    Place<Lanes> load, motor;
    Lanes sum_before, sum_after;
  };

  Machines<Lanes> machines_;
  Place<Lanes> here_, next_, motor_, load_, trial_, sum_;
  Touch<Lanes> touch_;
  Lanes force_, teeth_, middle_;  // of the teeth if they are pressed, through them, in the middle of the step
  Flags pressed_, changed_;
  Lanes step_, sum_before_, sum_after_, first_before_, first_after_, mean_, mean_of_next_ = {};
  Begin begin_;
  End end_;
  const double *positions_[kLanesOf<Lanes>], *rates_[kLanesOf<Lanes>];  // of the motor
};

/// The torque of a stage. Half of the time no teeth are pressed, and powers take most of the time.
template <int Parts, typename Lanes>
DIAGNOSIS_LANES void press(Loads<Lanes>* parts) {
  LaneBits<Lanes> pressed = {};
  for (int p = 0; p < Parts; ++p) pressed |= parts[p].pressed();
  if (any(pressed))
    for (int p = 0; p < Parts; ++p) parts[p].press();
  else
    for (int p = 0; p < Parts; ++p) parts[p].leave();
}

template <int Parts, typename Lanes, typename T>
DIAGNOSIS_LANES void move_part(Loads<Lanes>* parts, const Step<T>& s) {
  for (int p = 0; p < Parts; ++p) parts[p].first_stage(s);
  for (int p = 0; p < Parts; ++p) parts[p].move_motor(s.half);
  press<Parts>(parts);
  for (int p = 0; p < Parts; ++p) parts[p].template stage<T>(2, s.length / 2, s.before[1], s.after[1]);
  press<Parts>(parts);
  for (int p = 0; p < Parts; ++p) parts[p].template stage<T>(2, s.length, s.before[1], s.after[1]);
  for (int p = 0; p < Parts; ++p) parts[p].move_motor(s.end);
  press<Parts>(parts);
  for (int p = 0; p < Parts; ++p) parts[p].last_stage(s);
}

/// Takes the step from `from` of an interval, `share` of it long, again.
template <typename Lanes>
DIAGNOSIS_LANES void move_with_change(Loads<Lanes>& part, double from, double share, double interval) {
  const Lanes change = from + share * part.go_back(share * interval);
  move_part<1>(&part, Step<Lanes>(Lanes{} + from, change, interval));
  part.change();
  move_part<1>(&part, Step<Lanes>(change, Lanes{} + (from + share), interval));
  part.end_change();
}

template <int Parts, typename Lanes>
DIAGNOSIS_LANES void move_step(Loads<Lanes>* parts, double from, double share, double interval) {
  for (int p = 0; p < Parts; ++p) parts[p].keep_begin();
  move_part<Parts>(parts, Step<double>(from, from + share, interval));
  LaneBits<Lanes> may_press = {}, changed = {};
  for (int p = 0; p < Parts; ++p) may_press |= parts[p].may_press();
  if (any(may_press))
    for (int p = 0; p < Parts; ++p) changed |= parts[p].changed();
  if (any(changed))
    for (int p = 0; p < Parts; ++p) move_with_change(parts[p], from, share, interval);
  for (int p = 0; p < Parts; ++p) parts[p].end_step();
}

/// Where the columns of some runs go.
struct Columns {
  double *teeth, *position, *rate;
};

/// Moves kTraverseRuns, of which the first `count` are wanted.
template <typename Lanes>
DIAGNOSIS_LANES void move_all(const TraverseData& data, const TraverseRun* const* runs, Eigen::Index count,
                              const Columns& to) {
  constexpr int kLanes = kLanesOf<Lanes>, kParts = kTraverseRuns / kLanes;
  Loads<Lanes> parts[kParts];
  for (int p = 0; p < kParts; ++p) parts[p].start(data, runs + p * kLanes);
  const double share = 1.0 / data.steps;
  for (std::size_t k = 0; k < data.samples; ++k) {
    for (int i = 0; i < count; ++i) {
      const std::size_t at = static_cast<std::size_t>(i) * data.samples + k;
      to.position[at] = parts[i / kLanes].position(i % kLanes),
      to.rate[at] = parts[i / kLanes].rate(i % kLanes);
    }
    if (k + 1 == data.samples) break;
    for (int p = 0; p < kParts; ++p) parts[p].begin(k);
    for (int s = 0; s < data.steps; ++s) move_step<kParts>(parts, s * share, share, data.interval);
    for (int i = 0; i < count; ++i)
      to.teeth[static_cast<std::size_t>(i) * data.samples + k] = parts[i / kLanes].mean(i % kLanes);
  }
}

using Lanes2 = double __attribute__((vector_size(16)));

#if defined(__x86_64__)
using Lanes4 = double __attribute__((vector_size(32)));
using Lanes8 = double __attribute__((vector_size(64)));

__attribute__((target("avx512f,prefer-vector-width=512"))) void move_avx512(const TraverseData& data,
                                                                            const TraverseRun* const* runs,
                                                                            Eigen::Index count,
                                                                            const Columns& to) {
  move_all<Lanes8>(data, runs, count, to);
}

__attribute__((target("avx2"))) void move_avx2(const TraverseData& data, const TraverseRun* const* runs,
                                               Eigen::Index count, const Columns& to) {
  move_all<Lanes4>(data, runs, count, to);
}
#endif

void move(const TraverseData& data, const TraverseRun* const* runs, Eigen::Index count, const Columns& to) {
#if defined(__x86_64__)
  static const bool has_avx512 = __builtin_cpu_supports("avx512f");
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx512) return move_avx512(data, runs, count, to);
  if (has_avx2) return move_avx2(data, runs, count, to);
#endif
  move_all<Lanes2>(data, runs, count, to);
}

}  // namespace

TraverseMotion traverse_motion(const TraverseData& data, const std::vector<TraverseRun>& runs) {
  const auto all = static_cast<Eigen::Index>(runs.size());
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(data.samples), all);
  TraverseMotion motion{none, none, none};
  for (Eigen::Index first = 0; first < all; first += kTraverseRuns) {
    const Eigen::Index count = std::min<Eigen::Index>(kTraverseRuns, all - first);
    const TraverseRun* group[kTraverseRuns];
    for (Eigen::Index i = 0; i < kTraverseRuns; ++i)
      group[i] = &runs[static_cast<std::size_t>(first + std::min(i, count - 1))];
    move(data, group, count,
         {motion.teeth.col(first).data(), motion.position.col(first).data(), motion.rate.col(first).data()});
  }
  return motion;
}

}  // namespace backlash::diagnosis
