// SPDX-License-Identifier: BSD-3-Clause
// Damping solved exactly for a restitution that falls with speed (Herbert and McWhannell 1977; Sarkar, Ellis
// and Moore 1997, Section 4.2):
//   e = 1 - alpha v^beta,  D (1+e) = ln((1+D)/(1-e D)),  F = max(0, K d^n (1 + D d' / v))
// The impact of two free bodies has exactly this e for any masses, K and n. Speeds, units, ranges:
// restitution_damped.h.
#include "backlash_diagnosis/model/restitution.h"
#include "laws.h"
#include "restitution_damped.h"

namespace backlash::model {
namespace {

class HerbertMcWhannell : public RestitutionDamped {
 public:
  HerbertMcWhannell(double stiffness, double exponent, double minimum_speed, FallingRestitution restitution)
      : RestitutionDamped(stiffness, exponent, minimum_speed), restitution_(restitution) {}

 private:
  double damping(double speed) const override {
    // To solve takes half a microsecond, and one contact asks hundreds of times for the same.
    thread_local double solved_e = 1, solved_damping = 0;
    const double e = restitution_.at(speed);
    if (e != solved_e) {
      solved_damping = damping_of_restitution(e);
      solved_e = e;
    }
    return solved_damping;
  }

  FallingRestitution restitution_;
};

}  // namespace

ContactLawType herbert_mcwhannell_contact() {
  return {"herbert_mcwhannell", falling_restitution_parameters(),
          make_falling_restitution<HerbertMcWhannell>};
}

}  // namespace backlash::model
