// SPDX-License-Identifier: BSD-3-Clause
// A gear whose bearing and encoder stand before the shaft that turns the load. It is massless beside the
// load:
//   T(q_M - q_G) - R = k (q_G - q_L)        T through the teeth, R dry friction of its bearing
// It stands while -F_- <= R <= F_+, and moves no farther than it must to keep R within: a play operator
// (Prandtl 1928; Visintin 1994, ch. III).
#pragma once

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/gear_train.h"

namespace backlash::simulation {

struct Gear {
  double position = 0;  // rad
  int slides = 0;       // +1, -1: which way; 0: it stands
  double slope = 0;     // N m/rad, of shaft and teeth where these touch; 0: not known
};

struct GearedShaft {
  double stiffness = 0;  // N m/rad, of the shaft; 0: there is none, the gear is the load

  explicit operator bool() const { return stiffness > 0; }

  /// rad/s, of the gear as its balance changes; `touches`: whether teeth do.
  double rate(const Gear& gear, bool touches, double motor_rate, double link_rate) const {
    if (gear.slides == 0) return 0;
    if (!touches) return link_rate;
    return motor_rate + stiffness / std::max(gear.slope, stiffness) * (link_rate - motor_rate);
  }

  /// The gear after a moment in which it was as `before`, with the link at `link` and `guess` [rad] where the
  /// gear may be now. `forces(q)` are those on the load with the gear at q; it is asked last where the gear
  /// is. The torque through the teeth falls with q.
  template <typename ForcesAt>
  Gear follow(const Gear& before, double guess, double link, const ForcesAt& forces) const {
    const auto balance = [&](double q, int way) {
      const model::GearTrain::LoadForces& f = forces(q);
      const double limit = way > 0 ? f.friction.forward : -f.friction.backward;
      return Balance{f.mesh_torque - stiffness * (q - link) - limit, f.mesh_torque != 0};
    };
    if (before.slides != 0) {
      const Gear on = slid(before, before.slides, guess, balance);
      if (on.slides * (on.position - before.position) >= 0) return on;
    }
    for (const int way : {1, -1})
      if (way * balance(before.position, way).rubs > 0) return slid(before, way, guess, balance);
    return {before.position, 0, before.slope};
  }

 private:
  struct Balance {
    double rubs;  // N m, beyond the limit of friction
    bool touches;
  };

  /// Where friction is at its limit: a secant within the bracket that the shaft's stiffness alone gives.
  template <typename BalanceAt>
  Gear slid(const Gear& before, int way, double guess, const BalanceAt& balance) const {
    double q = guess, slope = std::max(before.slope, stiffness);
    Balance at = balance(q, way);
    double low = at.rubs > 0 ? q : q + at.rubs / stiffness, high = at.rubs > 0 ? q + at.rubs / stiffness : q;
    for (int i = 0; i < kMostSteps && std::fabs(at.rubs) > kSharp * stiffness; ++i) {
      double next = q + at.rubs / (at.touches ? slope : stiffness);
      if (!(next > low && next < high)) next = 0.5 * (low + high);
      const Balance at_next = balance(next, way);
      if (at.touches && at_next.touches) slope = std::max(stiffness, (at.rubs - at_next.rubs) / (next - q));
      q = next, at = at_next;
      (at.rubs > 0 ? low : high) = q;
    }
    return {q, way, slope};
  }

  static constexpr int kMostSteps = 60;
  static constexpr double kSharp = 1e-10;  // rad, far below what an encoder shows
};

}  // namespace backlash::simulation
