// SPDX-License-Identifier: BSD-3-Clause
// A gear whose bearing and encoder stand before the shaft that turns the load, for one load (Real = double)
// and for several side by side (lanes, whose header stands before this one). It is massless beside the load:
//   T(q_M - q_G) - R = k (q_G - q_L)        T through the teeth, R dry friction of its bearing
// It stands while -F_- <= R <= F_+, and moves no farther than it must to keep R within: a play operator
// (Prandtl 1928; Visintin 1994, ch. III).
#pragma once

#include "driven_step.h"
#include "one_lane.h"

namespace backlash::simulation {

template <typename Real>
struct alignas(sizeof(Real)) Gear {
  Real position = {};  // rad
  Real slides = {};    // +1, -1: which way; 0: it stands
  Real slope = {};     // N m/rad, of shaft and teeth where these touch; 0: not known
};

/// N m: through the teeth, and what the bearing holds either way.
template <typename Real>
struct alignas(sizeof(Real)) OnGear {
  Real mesh_torque, forward, backward;
};

template <typename Real>
struct alignas(sizeof(Real)) GearedShaft {
  Real stiffness = {};  // N m/rad, of the shaft

  /// rad/s, of the gear as its balance changes; `mesh_torque` at that moment.
  BACKLASH_LANES Real rate(const Gear<Real>& gear, const Real& mesh_torque, const Real& motor_rate,
                           const Real& link_rate) const {
    const Real none = {}, with_teeth = stiffness / larger(gear.slope, stiffness) * (link_rate - motor_rate);
    const Real sliding = magnitude(mesh_torque) > none ? motor_rate + with_teeth : link_rate;
    return magnitude(gear.slides) > none ? sliding : none;
  }

  /// The gear after a moment in which it was as `before`, with the link at `link`. `acting(q)` is what acts
  /// with the gear at q; it is asked last where the gear is. The torque through the teeth falls with q: where
  /// friction is at its limit is found by a secant within the bracket that the shaft's stiffness alone gives.
  template <typename ActingAt>
  BACKLASH_LANES Gear<Real> follow(const Gear<Real>& before, const Real& link, const ActingAt& acting) const {
    const Real none = {}, sharp = kSharp * stiffness;
    Real q = before.position, slope = larger(before.slope, stiffness);
    OnGear<Real> on = acting(q);
    const auto pull = [&]() __attribute__((always_inline)) {
      return on.mesh_torque - stiffness * (q - link);
    };
    const Real pulls = pull();
    const Real way = pulls > on.forward ? none + 1 : pulls < -on.backward ? none - 1 : none;
    const auto beyond = [&]() __attribute__((always_inline)) {
      const Real over = pull() - (way > none ? on.forward : -on.backward);
      return magnitude(way) > none ? over : none;
    };
    Real rubs = beyond(), low = smaller(q, q + rubs / stiffness), high = larger(q, q + rubs / stiffness);
    for (int i = 0; i < kMostSteps && any_positive(Real(magnitude(rubs) - sharp)); ++i) {
      const Real from = q, before_step = rubs, touched = magnitude(on.mesh_torque);
      const Real step = q + rubs / (touched > none ? slope : stiffness), middle = 0.5 * (low + high);
      const Real within = step < low ? middle : step > high ? middle : step;
      q = magnitude(rubs) > sharp ? within : q;
      on = acting(q);
      rubs = beyond();
      const Real found = larger(stiffness, (before_step - rubs) / (q - from));
      const Real both = smaller(smaller(touched, magnitude(on.mesh_torque)), magnitude(q - from));
      slope = both > none ? found : slope;
      low = rubs > none ? q : low;
      high = rubs > none ? high : q;
    }
    return {q, way, slope};
  }

 private:
  static constexpr int kMostSteps = 60;
  static constexpr double kSharp = 1e-10;  // rad, far below what an encoder shows
};

/// A plain load behind a shaft.
template <typename Real>
struct alignas(sizeof(Real)) GearedLoad {
  PlainLoad<Real> plain;
  GearedShaft<Real> shaft;
  Real forward, backward;  // N m, that the gear's bearing holds

  struct alignas(sizeof(Real)) Forces : PlainLoad<Real>::Forces {
    Gear<Real> gear;
  };

  /// `before`: a moment before.
  BACKLASH_LANES Forces forces(const Moment& m, const Real& position, const Real& rate,
                               const Forces& before) const {
    const Real none = {};
    const Real gear_rate = shaft.rate(before.gear, before.mesh_torque, none + m.motor_rate, rate);
    Forces f;
    f.gear = shaft.follow(
        before.gear, position, [&](const Real& q) __attribute__((always_inline)) {
          f.mesh_torque = plain.mesh_torque(m, q, gear_rate);
          return OnGear<Real>{f.mesh_torque, forward, backward};
        });
    f.net = plain.net(m, gear_rate, f.mesh_torque) +
            (shaft.stiffness * (f.gear.position - position) - f.mesh_torque);
    return f;
  }
};

}  // namespace backlash::simulation
