// SPDX-License-Identifier: BSD-3-Clause
// Damping from the energy balance with the undamped speed profile, for a restitution that falls with speed
// (Yang and Sun 1985, after Herbert and McWhannell 1977; Sarkar, Ellis and Moore 1997, Eq. 13):
//   e = 1 - alpha v^beta,  D = 6 (1-e) / ((2e-1)^2 + 3),  F = max(0, K d^n (1 + D d' / v))
// An impact bounces a little more than e says: 0.901 for 0.9, 0.807 for 0.8, 0.594 for 0.5, by the exact
// relation of model/restitution.h. Speeds, units, ranges: restitution_damped.h.
#include "backlash_diagnosis/model/restitution.h"
#include "laws.h"
#include "restitution_damped.h"

namespace backlash::model {
namespace {

class YangSun : public RestitutionDamped {
 public:
  YangSun(double stiffness, double exponent, double minimum_speed, FallingRestitution restitution)
      : RestitutionDamped(stiffness, exponent, minimum_speed), restitution_(restitution) {}

 private:
  double damping(double speed) const override { return yang_sun_damping(restitution_.at(speed)); }

  FallingRestitution restitution_;
};

}  // namespace

ContactLawType yang_sun_contact() {
  return {"yang_sun", falling_restitution_parameters(), make_falling_restitution<YangSun>};
}

}  // namespace backlash::model
