// SPDX-License-Identifier: BSD-3-Clause
// What the laws share whose damping is set for a wanted restitution at each touch:
//   F = max(0, K d^n (1 + D(e) d' / v))        K [N/m^n] > 0, 1 <= n <= 1.5
// v [m/s] is the approach speed latched at the last touch, e(v) the wanted restitution, D [-] differs from
// law to law. 1/v is singular for slow touches, so v is never less than `minimum_speed` [m/s] > 0: slower
// touches, and a contact that no touch began, have the damping of a touch at that speed, and lose less than e
// says. The clamp acts only at d' < -v / D, faster than any free rebound.
#pragma once

#include <algorithm>

#include "power.h"

namespace backlash::model {

class RestitutionDamped : public PowerElastic {
 public:
  RestitutionDamped(double stiffness, double exponent, double minimum_speed)
      : PowerElastic(stiffness, exponent), minimum_speed_(minimum_speed) {}
  bool needs_impact_speed() const override { return true; }
  double force(double d, double rate, double impact_speed) const override {
    const double speed = std::max(impact_speed, minimum_speed_);
    return spring(d) * std::max(0.0, 1 + damping(speed) * rate / speed);
  }

 private:
  /// D for a touch at this speed.
  virtual double damping(double speed) const = 0;

  double minimum_speed_;
};

/// Wanted restitution that falls with speed as e = 1 - alpha v^beta (Herbert and McWhannell 1977),
/// alpha >= 0 in (s/m)^beta, beta > 0. Valid where e >= 0.05; faster touches get 0.05.
struct FallingRestitution {
  double alpha, beta;
  double at(double speed) const { return std::max(0.05, 1 - alpha * std::pow(speed, beta)); }
};

/// Their parameters in a rig file.
inline ParameterSpec minimum_speed() {
  return {"minimum_speed", "m/s", Range::positive(), "slower touches are damped as if at this speed"};
}
inline std::vector<ParameterSpec> falling_restitution_parameters() {
  return {power_stiffness(),
          power_exponent(),
          {"alpha", "(s/m)^beta", Range::not_negative(), "loss 1 - e at 1 m/s"},
          {"beta", "1", Range::positive(), "exponent of the speed in 1 - e"},
          minimum_speed()};
}

/// Creates a law whose constructor takes (stiffness, exponent, minimum speed, restitution).
template <typename Law>
std::unique_ptr<ContactLaw> make_falling_restitution(const ParameterValues& p) {
  return std::make_unique<Law>(p.at("stiffness"), p.at("exponent"), p.at("minimum_speed"),
                               FallingRestitution{p.at("alpha"), p.at("beta")});
}

}  // namespace backlash::model
