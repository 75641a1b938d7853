// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/ensemble.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "lanes.h"
#include "tolerances.h"
#include "tsitouras.h"
#include "work_limit.h"

namespace backlash::simulation {
namespace {

using namespace tsitouras;

constexpr int kMaxStates = model::GearTrain::kMaxStates;
constexpr double kSafety = 0.9, kShrink = 0.2, kGrow = 8;
constexpr double kFirst = 0.01;       // of the time in which the state would change by itself
constexpr double kLeastFirst = 1e-7;  // s, of a first step from rest

double rounding(double t) {
  return 4 * std::numeric_limits<double>::epsilon() * std::fabs(t);
}

/// The contact of several rigs: PowerContact, with what the gap adds.
struct LaneContact {
  double exponent;
  Lanes stiffness, loss, damping, half_gap;

  BACKLASH_LANES Lanes power(const Lanes& d) const {
    if (exponent == 1.5) return d * root(d);
    if (exponent == 1) return d;
    Lanes p = d;
    any_power(p);
    return p;
  }

  __attribute__((noinline)) void any_power(Lanes& d) const {
    for (int i = 0; i < kLanes; ++i) d[i] = std::pow(d[i], exponent);
  }

  BACKLASH_LANES Lanes force(const Lanes& x, const Lanes& v) const {
    const Lanes depth = magnitude(x) - half_gap, none = {};
    const Lanes touching = larger(depth, none), rate = x > 0 ? v : -v;
    const Lanes push =
        larger(stiffness * power(touching) * larger(1 + loss * rate, none) + damping * rate, none);
    return depth > 0 ? (x > 0 ? push : -push) : none;
  }
};

struct LaneTolerance {
  Lanes absolute, largest;
};

/// One attempt at a step; all that it reads and writes.
struct Attempt {
  const model::EquationsOfMotion<Lanes>& train;
  const LaneContact& contact;
  const LaneTolerance* tolerances;
  double relative;
  const double* torques;     // of the stages [N m]
  const Lanes* torque_gain;  // of motor, of load: 1 or the reduction, and 0
  double h;
  const Lanes* start;
  Lanes (*rates)[kMaxStates];  // of the stages; the first is given
  Lanes* end;
  double error;  // worst of all rigs, 1 where it is just allowed
};

template <int Number>
BACKLASH_LANES void attempt(Attempt& a) {
  static constexpr model::TrainLayout layout = model::TrainLayout::numbered(Number);
  constexpr int kStates = 2 * layout.dof;
  Lanes(*const k)[kMaxStates] = a.rates;
  const auto force = [&](const Lanes& x, const Lanes& v) __attribute__((always_inline)) {
    return a.contact.force(x, v);
  };
#pragma GCC unroll 8
  for (int stage = 1; stage < kStages; ++stage) {
    Lanes y[kStates];
#pragma GCC unroll 8
    for (int i = 0; i < kStates; ++i) {
      Lanes sum = kA[stage][0] * k[0][i];
#pragma GCC unroll 8
      for (int j = 1; j < stage; ++j) sum += kA[stage][j] * k[j][i];
      y[i] = a.start[i] + a.h * sum;
    }
    a.train.derivative(layout, y, a.torques[stage] * a.torque_gain[0], a.torques[stage] * a.torque_gain[1],
                       a.contact.half_gap, force, k[stage]);
    if (stage == kStages - 1)
      for (int i = 0; i < kStates; ++i) a.end[i] = y[i];
  }
  Lanes square = {};
#pragma GCC unroll 8
  for (int i = 0; i < kStates; ++i) {
    Lanes sum = kError[0] * k[0][i];
#pragma GCC unroll 8
    for (int j = 1; j < kStages; ++j) sum += kError[j] * k[j][i];
    const Lanes size = larger(magnitude(a.start[i]), magnitude(a.end[i]));
    const Lanes scaled =
        a.h * sum / (a.tolerances[i].absolute + a.relative * smaller(size, a.tolerances[i].largest));
    square += scaled * scaled;
  }
  a.error = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    const double error = std::sqrt(square[lane] / kStates);
    a.error = error > a.error || std::isnan(error) ? error : a.error;
  }
}

// The same function for processors with and without AVX2.
using AttemptFunction = void (*)(Attempt&);

template <int Number>
void attempt_plain(Attempt& a) {
  attempt<Number>(a);
}

#if defined(__x86_64__)
template <int Number>
__attribute__((target("avx2"))) void attempt_avx2(Attempt& a) {
  attempt<Number>(a);
}

template <int Number>
AttemptFunction attempt_of() {
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  return has_avx2 ? attempt_avx2<Number> : attempt_plain<Number>;
}
#else
template <int Number>
AttemptFunction attempt_of() {
  return attempt_plain<Number>;
}
#endif

AttemptFunction attempt_of(const model::TrainLayout& layout) {
  return model::with_constant_number(layout,
                                     [](auto number) { return attempt_of<decltype(number)::value>(); });
}

}  // namespace

/// Rigs that share their steps.
struct alignas(sizeof(Lanes)) Ensemble::Group {
  model::TrainLayout layout;
  model::EquationsOfMotion<Lanes> train;
  LaneContact contact;
  LaneTolerance tolerances[kMaxStates];
  double relative;
  Lanes torque_gain[2];
  AttemptFunction attempt;
  int states;

  double from = 0, step = 0;  // s, start and length of the last step
  double next = 0;            // s, length of the next
  long steps = 0;
  Lanes begin[kMaxStates] = {}, end[kMaxStates] = {};  // of the last step
  Lanes rates[kStages][kMaxStates];                    // of the last step; its last stage begins the next
  Lanes state[kMaxStates] = {};                        // where they were moved to

  Group(const model::GearTrain* trains, std::size_t count, const SolverSettings& solver, bool at_load);
  void restart(double t, double torque);
  void advance_to(double t, double stop, const Excitation& excitation, long segment);
  void take_step(double stop, const Excitation& excitation, long segment);
  void interpolate(double t);
};

/// A group that is not full moves its last rig several times.
Ensemble::Group::Group(const model::GearTrain* trains, std::size_t count, const SolverSettings& solver,
                       bool at_load)
    : layout(trains[0].layout()),
      relative(solver.relative_tolerance),
      attempt(attempt_of(layout)),
      states(2 * layout.dof) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const model::GearTrain& rig = trains[std::min<std::size_t>(lane, count - 1)];
    const model::EquationsOfMotion<double>& one = rig.equations();
    for (int part = 0; part < model::TrainParts::kPartCount; ++part) {
      train.damping[part][lane] = one.damping[part];
      train.asymmetry[part][lane] = one.asymmetry[part];
      train.inverse_inertia[part][lane] = one.inverse_inertia[part];
    }
    train.input_stiffness[lane] = one.input_stiffness;
    train.input_damping[lane] = one.input_damping;
    train.output_stiffness[lane] = one.output_stiffness;
    train.output_damping[lane] = one.output_damping;
    train.lever[lane] = one.lever;
    train.start[lane] = one.start;
    const model::PowerContact law = *rig.power_contact();
    contact.exponent = law.exponent;
    contact.stiffness[lane] = law.stiffness;
    contact.loss[lane] = law.loss;
    contact.damping[lane] = law.damping;
    contact.half_gap[lane] = 0.5 * rig.backlash();
    torque_gain[0][lane] = at_load ? 0 : rig.ratio();
    torque_gain[1][lane] = at_load ? 1 : 0;
  }
  const std::vector<StateTolerance> each = state_tolerances(layout.dof, solver);
  for (int i = 0; i < states; ++i) tolerances[i] = {Lanes{} + each[i].absolute, Lanes{} + each[i].largest};
}

/// After a jump of the torque the derivative is another and the step that suits it unknown.
void Ensemble::Group::restart(double t, double torque) {
  from = t;
  step = 0;
  const auto force = [this](const Lanes& x, const Lanes& v) { return contact.force(x, v); };
  Lanes* const rate = rates[kStages - 1];
  train.derivative(layout, end, torque * torque_gain[0], torque * torque_gain[1], contact.half_gap, force,
                   rate);
  double size = 0, change = 0;
  for (int i = 0; i < states; ++i) {
    const Lanes weight =
        1 / (tolerances[i].absolute + relative * smaller(magnitude(end[i]), tolerances[i].largest));
    for (int lane = 0; lane < kLanes; ++lane) {
      size = std::max(size, std::fabs(end[i][lane] * weight[lane]));
      change = std::max(change, std::fabs(rate[i][lane] * weight[lane]));
    }
  }
  next = std::max(kLeastFirst, change > 0 ? kFirst * size / change : 0);
}

void Ensemble::Group::take_step(double stop, const Excitation& excitation, long segment) {
  from += step;
  std::copy(end, end + states, begin);
  std::copy(rates[kStages - 1], rates[kStages - 1] + states, rates[0]);
  for (;;) {
    const double left = stop - from;
    step = left <= next ? left : left < 2 * next ? 0.5 * left : next;
    if (!(step > rounding(from)))
      throw IntegrationError("ensemble: the step is below rounding at t = " + std::to_string(from) + " s");
    double torques[kStages];
    for (int stage = 0; stage < kStages; ++stage)
      torques[stage] = excitation.torque(from + kC[stage] * step, segment);
    Attempt a{train, contact, tolerances, relative, torques, torque_gain, step, begin, rates, end, 0};
    attempt(a);
    const double factor = std::clamp(kSafety * std::pow(a.error, -0.2), kShrink, kGrow);  // of NaN: NaN
    next = step * (std::isnan(a.error) ? kShrink : factor);
    if (a.error <= 1) break;
  }
  ++steps;
}

void Ensemble::Group::interpolate(double t) {
  if (t >= from + step) {
    std::copy(end, end + states, state);
    return;
  }
  double weights[kStages];
  interpolant((t - from) / step, weights);
  for (int i = 0; i < states; ++i) {
    Lanes sum = weights[0] * rates[0][i];
    for (int j = 1; j < kStages; ++j) sum += weights[j] * rates[j][i];
    state[i] = begin[i] + step * sum;
  }
}

void Ensemble::Group::advance_to(double t, double stop, const Excitation& excitation, long segment) {
  const long most = steps + kMaxStepsPerCall;
  while (t - (from + step) > rounding(t)) {
    if (steps == most)
      throw IntegrationError("ensemble: " + std::to_string(kMaxStepsPerCall) +
                             " steps did not suffice at t = " + std::to_string(from) + " s; " + kTooStiff);
    take_step(stop, excitation, segment);
  }
  interpolate(t);
}

bool Ensemble::takes(const std::vector<model::Rig>& rigs, const ExcitationSettings& excitation) {
  if (rigs.empty() || excitation.is_speed_loop() || excitation.type == "topic" || excitation.motor_brake)
    return false;
  std::optional<int> layout;
  std::optional<double> exponent;
  for (const model::Rig& rig : rigs) {
    const model::GearTrain train(rig);
    const std::optional<model::PowerContact> contact = train.power_contact();
    if (!train.smooth() || !contact) return false;
    if (layout && *layout != train.layout().number()) return false;
    if (exponent && *exponent != contact->exponent) return false;
    layout = train.layout().number();
    exponent = contact->exponent;
  }
  return true;
}

Ensemble::Ensemble(const std::vector<model::Rig>& rigs, const ExcitationSettings& excitation,
                   const SolverSettings& solver)
    : at_load_(excitation.at_load), excitation_(excitation.create()) {
  if (!takes(rigs, excitation))
    throw InvalidParameter("rigs", double(rigs.size()), "cannot be moved at once");
  if (at_load_ && rigs.front().link_locked)
    throw InvalidParameter("excitation.at", "load", "the link is locked");
  for (const model::Rig& rig : rigs) trains_.emplace_back(rig);
  for (std::size_t first = 0; first < trains_.size(); first += kLanes)
    groups_.emplace_back(&trains_[first], trains_.size() - first, solver, at_load_);
  for (Group& group : groups_) group.restart(0, excitation_->torque(0, 0));
}

Ensemble::~Ensemble() = default;

void Ensemble::advance_to(double t) {
  if (!std::isfinite(t) || t < time_ - rounding(time_))
    throw InvalidParameter("time", t, "must be finite and >= " + std::to_string(time_) + " s");
  const double reach = t + rounding(t);
  for (double stop = excitation_->segment_end(segment_); stop <= reach;
       stop = excitation_->segment_end(segment_)) {
    for (Group& group : groups_) group.advance_to(stop, stop, *excitation_, segment_);
    const double torque = excitation_->torque(stop, ++segment_);
    for (Group& group : groups_) group.restart(stop, torque);
    time_ = stop;
  }
  time_ = std::max(t, time_);
  const double stop = excitation_->segment_end(segment_);
  for (Group& group : groups_) group.advance_to(time_, stop, *excitation_, segment_);
}

std::vector<double> Ensemble::state(std::size_t rig) const {
  const Group& group = groups_.at(rig / kLanes);
  std::vector<double> numbers(group.states);
  for (int i = 0; i < group.states; ++i) numbers[i] = group.state[i][rig % kLanes];
  return numbers;
}

model::Observation Ensemble::observe(std::size_t rig) const {
  const double torque = excitation_->torque(time_, segment_);
  return trains_.at(rig).observe(
      state(rig).data(), at_load_ ? model::AppliedTorque(0, torque) : model::AppliedTorque(torque, 0), time_);
}

long Ensemble::steps() const {
  long sum = 0;
  for (const Group& group : groups_) sum += group.steps;
  return sum;
}

}  // namespace backlash::simulation
