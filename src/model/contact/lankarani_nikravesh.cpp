// SPDX-License-Identifier: BSD-3-Clause
// Damping for a restitution that does not depend on speed (Lankarani and Nikravesh 1990; "Hertz-damp" of
// Yumrukcal 2013, Eq. 2.19, there with n = 3/2):
//   D = 3/4 (1 - e^2),  F = max(0, K d^n (1 + D d' / v))        0 <= e <= 1
// Made for e near 1: an impact bounces more than e says, 0.913 for 0.9, 0.725 for 0.5, by the exact relation
// of model/restitution.h. Speeds, units, ranges: restitution_damped.h.
#include "backlash_diagnosis/model/restitution.h"
#include "laws.h"
#include "restitution_damped.h"

namespace backlash::model {
namespace {

class LankaraniNikravesh : public RestitutionDamped {
 public:
  LankaraniNikravesh(double stiffness, double exponent, double minimum_speed, double restitution)
      : RestitutionDamped(stiffness, exponent, minimum_speed),
        damping_(lankarani_nikravesh_damping(restitution)) {}

 private:
  double damping(double) const override { return damping_; }

  double damping_;
};

}  // namespace

ContactLawType lankarani_nikravesh_contact() {
  return {
      "lankarani_nikravesh",
      {power_stiffness(), power_exponent(), {"restitution", "1", Range::between(0, 1), "e"}, minimum_speed()},
      [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
        return std::make_unique<LankaraniNikravesh>(p.at("stiffness"), p.at("exponent"),
                                                    p.at("minimum_speed"), p.at("restitution"));
      }};
}

}  // namespace backlash::model
