// SPDX-License-Identifier: BSD-3-Clause
// One attempt at a step of one rig (Real = double) or of several (Real = Lanes2 and so on), each by a step of
// its own, and what they did within their last steps.
//
// The explicit pair of Tsitouras (2011). Rigs do not wait for each other: one whose attempt fails tries again
// beside the next steps of the others, and one that is ahead stands (length 0) only where it would lose a
// step that is still asked for. So what a rig does is the same, bit by bit, whoever is beside it.
#pragma once

#include "backlash_diagnosis/model/equations_of_motion.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "lanes.h"
#include "power_teeth.h"
#include "tsitouras.h"

namespace backlash::simulation {

constexpr int kMaxStates = model::GearTrain::kMaxStates;

/// Steps that were taken, of each rig one or none by the same attempt.
template <typename Real>
struct alignas(sizeof(Real)) Steps {
  Real last;  // s, their end
  Real length;
  Real begin[kMaxStates];
  Real rates[tsitouras::kStages][kMaxStates];
};

template <typename Real>
struct StateTolerances {
  Real absolute, largest;
};

template <typename Real>
struct alignas(sizeof(Real)) LaneStep {
  model::EquationsOfMotion<Real> train;
  PowerTeeth<Real> teeth;
  StateTolerances<Real> tolerances[kMaxStates];
  double relative;
  Real torque_gain[2];  // of motor, of load: 1 or the reduction, and 0

  Real time;                                   // s, that each has reached
  Real state[kMaxStates], rate[kMaxStates];    // there
  Real next;                                   // s, length of the step that suits it
  Real length;                                 // s, of this attempt
  Real torques[tsitouras::kStages];            // N m, of the stages
  Real stage[tsitouras::kStages][kMaxStates];  // rates of this attempt
};

/// By which the length of a step changes after one with this square of its error, 1 where it is just allowed:
/// 0.9 error^(-1/5), within 8 and 1/10, by roots and a fraction that is that power where it matters. Square
/// roots and quotients are the same on all processors, other powers are not. NaN shrinks.
template <typename Real>
BACKLASH_LANES Real change_of_length(const Real& square) {
  const Real fourth = root(root(root(square)));  // root of the error
  const Real factor = 0.9 * (1.8 + 0.2 * fourth) / (0.2 + 1.8 * fourth);
  return larger(factor, Real{} + 0.1);
}

template <int Number, typename Real>
BACKLASH_LANES void derivative(const LaneStep<Real>& s, const Real* state, const Real& torque, Real* rate) {
  static constexpr model::TrainLayout layout = model::TrainLayout::numbered(Number);
  const auto force = [&](const Real& x, const Real& v) __attribute__((always_inline)) {
    return s.teeth.force(x, v);
  };
  s.train.derivative(layout, state, torque * s.torque_gain[0], torque * s.torque_gain[1], s.teeth.half_gap,
                     force, rate);
}

/// Mean square of the error over what is allowed.
template <int States, typename Real>
BACKLASH_LANES Real error_square(const LaneStep<Real>& s, const Real* end) {
  using namespace tsitouras;
  Real square = {};
#pragma GCC unroll 8
  for (int i = 0; i < States; ++i) {
    Real sum = kError[0] * s.stage[0][i];
#pragma GCC unroll 8
    for (int j = 1; j < kStages; ++j) sum += kError[j] * s.stage[j][i];
    const Real size = larger(magnitude(s.state[i]), magnitude(end[i]));
    const Real scaled =
        s.length * sum / (s.tolerances[i].absolute + s.relative * smaller(size, s.tolerances[i].largest));
    square += scaled * scaled;
  }
  return square * (1.0 / States);
}

/// Goes on by what was attempted, and keeps it in `steps`, where it is good enough.
template <int States, typename Real>
BACKLASH_LANES void accept(LaneStep<Real>& s, const Real* end, Steps<Real>& steps) {
  using namespace tsitouras;
  const Real square = error_square<States>(s, end), none = {};
  // A length and no flag: g++ makes a branch of each lane out of a vector of flags that was kept.
  const Real taken = square <= 1 ? s.length : none;
  s.next = s.length > none ? s.length * change_of_length(square) : s.next;
  s.time += taken;
  steps.last = taken > none ? s.time : steps.last;
  steps.length = taken > none ? s.length : steps.length;
#pragma GCC unroll 8
  for (int i = 0; i < States; ++i) {
    steps.begin[i] = taken > none ? s.state[i] : steps.begin[i];
    s.state[i] = taken > none ? end[i] : s.state[i];
    s.rate[i] = taken > none ? s.stage[kStages - 1][i] : s.rate[i];
#pragma GCC unroll 8
    for (int j = 0; j < kStages; ++j) steps.rates[j][i] = taken > none ? s.stage[j][i] : steps.rates[j][i];
  }
}

template <int Number, typename Real>
BACKLASH_LANES void attempt(LaneStep<Real>& s, Steps<Real>& steps) {
  using namespace tsitouras;
  constexpr int kStates = 2 * model::TrainLayout::numbered(Number).dof;
  Real y[kStates];
#pragma GCC unroll 8
  for (int i = 0; i < kStates; ++i) s.stage[0][i] = s.rate[i];
#pragma GCC unroll 8
  for (int stage = 1; stage < kStages; ++stage) {
#pragma GCC unroll 8
    for (int i = 0; i < kStates; ++i) {
      Real sum = kA[stage][0] * s.stage[0][i];
#pragma GCC unroll 8
      for (int j = 1; j < stage; ++j) sum += kA[stage][j] * s.stage[j][i];
      y[i] = s.state[i] + s.length * sum;
    }
    derivative<Number>(s, y, s.torques[stage], s.stage[stage]);
  }
  accept<kStates>(s, y, steps);
}

/// States at time t [s] within the steps.
template <int Number, typename Real>
BACKLASH_LANES void interpolate(const Steps<Real>& steps, double t, Real* state) {
  using namespace tsitouras;
  constexpr int kStates = 2 * model::TrainLayout::numbered(Number).dof;
  Real weights[kStages];
  interpolant(1 - (steps.last - t) / steps.length, weights);
#pragma GCC unroll 8
  for (int i = 0; i < kStates; ++i) {
    Real sum = weights[0] * steps.rates[0][i];
#pragma GCC unroll 8
    for (int j = 1; j < kStages; ++j) sum += weights[j] * steps.rates[j][i];
    state[i] = steps.begin[i] + steps.length * sum;
  }
}

}  // namespace backlash::simulation
