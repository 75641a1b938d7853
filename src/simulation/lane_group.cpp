// SPDX-License-Identifier: BSD-3-Clause
#include "lane_group.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "lane_step.h"
#include "lanes.h"
#include "take_lane.h"
#include "tolerances.h"
#include "work_limit.h"

namespace backlash::simulation {
namespace {

using namespace tsitouras;

constexpr double kFirst = 0.01;       // of the time in which the state would change by itself
constexpr double kLeastFirst = 1e-7;  // s, of a first step from rest
constexpr int kAhead = 4;             // steps that a rig may be ahead of what is asked for
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();  // relative, of times >= 0

/// What is compiled for each processor.
template <typename Real>
struct Functions {
  void (*attempt)(LaneStep<Real>&, Steps<Real>&);
  void (*interpolate)(const Steps<Real>&, double, Real*);
};

template <int Number, typename Real>
void attempt_plain(LaneStep<Real>& s, Steps<Real>& steps) {
  attempt<Number>(s, steps);
}

template <int Number, typename Real>
void interpolate_plain(const Steps<Real>& steps, double t, Real* state) {
  interpolate<Number>(steps, t, state);
}

#if defined(__x86_64__)
template <int Number, typename Real>
__attribute__((target("avx2"))) void attempt_avx2(LaneStep<Real>& s, Steps<Real>& steps) {
  attempt<Number>(s, steps);
}

template <int Number, typename Real>
__attribute__((target("avx2"))) void interpolate_avx2(const Steps<Real>& steps, double t, Real* state) {
  interpolate<Number>(steps, t, state);
}

template <int Number, typename Real>
__attribute__((target("avx512f"))) void attempt_avx512(LaneStep<Real>& s, Steps<Real>& steps) {
  attempt<Number>(s, steps);
}

template <int Number, typename Real>
__attribute__((target("avx512f"))) void interpolate_avx512(const Steps<Real>& steps, double t, Real* state) {
  interpolate<Number>(steps, t, state);
}
#endif

template <int Number, typename Real>
Functions<Real> functions_numbered() {
#if defined(__x86_64__)
  if constexpr (kLanesOf<Real> == 8) return {attempt_avx512<Number, Real>, interpolate_avx512<Number, Real>};
  if constexpr (kLanesOf<Real> == 4) return {attempt_avx2<Number, Real>, interpolate_avx2<Number, Real>};
#endif
  return {attempt_plain<Number, Real>, interpolate_plain<Number, Real>};
}

template <typename Real>
Functions<Real> functions_of(const model::TrainLayout& layout) {
  return model::with_constant_number(
      layout, [](auto number) { return functions_numbered<decltype(number)::value, Real>(); });
}

template <typename Real>
class alignas(sizeof(Real)) LaneGroup final : public RigGroup {
 public:
  LaneGroup(const std::vector<model::GearTrain>& trains, const SolverSettings& solver, bool at_load,
            bool held);
  void restart(double t, double torque) override;
  void advance_to(double t, double stop, const Excitation& excitation, long segment) override;
  double state(int rig, int i) const override { return lane(state_[i], rig); }
  long steps() const override { return attempts_; }

 private:
  void take(const model::GearTrain& rig, int at, bool at_load);
  void choose_lengths(double reach, double stop);
  void choose_torques(const Excitation& excitation, long segment);
  void show(double reach);

  static constexpr int kCount = kLanesOf<Real>;
  LaneStep<Real> step_ = {};
  Steps<Real> ring_[kAhead];  // of the last attempts
  Steps<Real> shown_;         // of each rig the one that it is asked for
  Real state_[kMaxStates] = {};
  model::TrainLayout layout_;
  Functions<Real> functions_;
  bool held_;
  long attempts_ = 0;
};

/// A group that is not full moves its last rig several times.
template <typename Real>
LaneGroup<Real>::LaneGroup(const std::vector<model::GearTrain>& trains, const SolverSettings& solver,
                           bool at_load, bool held)
    : layout_(trains[0].layout()), functions_(functions_of<Real>(layout_)), held_(held) {
  for (int i = 0; i < kCount; ++i) take(trains[std::min(std::size_t(i), trains.size() - 1)], i, at_load);
  const std::vector<StateTolerance> each = state_tolerances(layout_.dof, solver);
  for (int i = 0; i < 2 * layout_.dof; ++i)
    step_.tolerances[i] = {Real{} + each[i].absolute, Real{} + each[i].largest};
  step_.relative = solver.relative_tolerance;
}

template <typename Real>
void LaneGroup<Real>::take(const model::GearTrain& rig, int at, bool at_load) {
  const model::PowerContact law = *rig.power_contact();
  take_lane(step_.train, at, rig.equations());
  take_lane(step_.teeth, at,
            PowerTeeth<double>{law.exponent, law.stiffness, law.loss, law.damping, 0.5 * rig.backlash()});
  set_lane(step_.torque_gain[0], at, at_load ? 0 : rig.ratio());
  set_lane(step_.torque_gain[1], at, at_load ? 1 : 0);
}

template <typename Real>
void LaneGroup<Real>::restart(double t, double torque) {
  const int states = 2 * layout_.dof;
  step_.time = Real{} + t;
  for (Real& each : step_.torques) each = Real{} + torque;
  for (Steps<Real>& steps : ring_) steps.last = Real{} - kNever;
  shown_.last = Real{} - kNever;
  std::copy(step_.state, step_.state + states, state_);
  const auto force = [this](const Real& x, const Real& v) { return step_.teeth.force(x, v); };
  step_.train.derivative(layout_, step_.state, torque * step_.torque_gain[0], torque * step_.torque_gain[1],
                         step_.teeth.half_gap, force, step_.rate);
  Real size = {}, change = {};
  for (int i = 0; i < states; ++i) {
    const StateTolerances<Real>& allowed = step_.tolerances[i];
    const Real weight =
        1 / (allowed.absolute + step_.relative * smaller(magnitude(step_.state[i]), allowed.largest));
    size = larger(size, magnitude(step_.state[i] * weight));
    change = larger(change, magnitude(step_.rate[i] * weight));
  }
  const Real none = {};
  step_.next = larger(Real{} + kLeastFirst, change > none ? kFirst * size / change : none);
}

/// A rig stands where the attempt would take the place of a step that lasts until `reach` [s].
template <typename Real>
void LaneGroup<Real>::choose_lengths(double reach, double stop) {
  const Real none = {}, left = stop - step_.time;
  Real length = left <= step_.next ? left : left < 2 * step_.next ? 0.5 * left : step_.next;
  length = ring_[attempts_ % kAhead].last >= reach ? none : length;
  step_.length = left > kRounding * step_.time ? length : none;
  const Real missing = step_.length > none ? kRounding * step_.time - step_.length : none;
  if (any_positive(missing))
    throw IntegrationError("ensemble: the step is below rounding at t = " + std::to_string(reach) + " s");
}

template <typename Real>
void LaneGroup<Real>::choose_torques(const Excitation& excitation, long segment) {
  for (int stage = 1; stage < kStages; ++stage)
    for (int i = 0; i < kCount; ++i) {
      const double t = lane(step_.time, i) + kC[stage] * lane(step_.length, i);
      set_lane(step_.torques[stage], i, excitation.torque(t, segment));
    }
}

template <typename Real>
void LaneGroup<Real>::advance_to(double t, double stop, const Excitation& excitation, long segment) {
  const double reach = t - kRounding * t;
  const long most = attempts_ + kMaxStepsPerCall;
  while (any_positive(Real(reach - step_.time))) {
    if (attempts_ == most)
      throw IntegrationError("ensemble: " + std::to_string(kMaxStepsPerCall) +
                             " steps did not suffice before t = " + std::to_string(t) + " s; " + kTooStiff);
    choose_lengths(reach, stop);
    if (!held_) choose_torques(excitation, segment);
    functions_.attempt(step_, ring_[attempts_++ % kAhead]);
  }
  show(reach);
  if (!any_positive(Real(reach - shown_.last))) functions_.interpolate(shown_, t, state_);
}

/// Of each rig the first step that lasts until `reach` [s].
template <typename Real>
void LaneGroup<Real>::show(double reach) {
  for (int i = 0; i < kCount; ++i) {
    if (lane(shown_.last, i) >= reach) continue;
    const Steps<Real>* first = nullptr;
    for (const Steps<Real>& steps : ring_)
      if (lane(steps.last, i) >= reach && (!first || lane(steps.last, i) < lane(first->last, i)))
        first = &steps;
    if (!first) return;  // at the start of a segment, where nothing has moved
    const auto copy = [i](Real& to, const Real& from) { set_lane(to, i, lane(from, i)); };
    copy(shown_.last, first->last);
    copy(shown_.length, first->length);
    for (int s = 0; s < 2 * layout_.dof; ++s) {
      copy(shown_.begin[s], first->begin[s]);
      for (int stage = 0; stage < kStages; ++stage) copy(shown_.rates[stage][s], first->rates[stage][s]);
    }
  }
}

/// How many rigs this processor works on at once.
std::size_t lanes_here() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return 8;
  if (__builtin_cpu_supports("avx2")) return 4;
#endif
  return 2;
}

}  // namespace

std::size_t rigs_of_group(std::size_t count) {
  return std::min(count, lanes_here());
}

std::unique_ptr<RigGroup> make_group(const std::vector<model::GearTrain>& trains,
                                     const SolverSettings& solver, bool at_load, bool held) {
  if (trains.size() == 1) return std::make_unique<LaneGroup<double>>(trains, solver, at_load, held);
  switch (lanes_here()) {
#if defined(__x86_64__)
    case 8:
      return std::make_unique<LaneGroup<Lanes8>>(trains, solver, at_load, held);
    case 4:
      return std::make_unique<LaneGroup<Lanes4>>(trains, solver, at_load, held);
#endif
    default:
      return std::make_unique<LaneGroup<Lanes2>>(trains, solver, at_load, held);
  }
}

}  // namespace backlash::simulation
