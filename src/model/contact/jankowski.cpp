// SPDX-License-Identifier: BSD-3-Clause
// Elastic contact that is damped on approach only, so it never pulls (Jankowski 2005; Yumrukcal 2013,
// Section 2.2.2.2):
//   F = K d^(3/2) + c d' for d' > 0, K d^(3/2) else;  c = 2 xi sqrt(K m sqrt(d))                (2.21)
//   xi = 9 sqrt(5)/2 (1 - e^2) / (e (e (9 pi - 16) + 16))                                         (2.24)
// K [N/m^(3/2)] > 0 stiffness, 0 < e <= 1 restitution, m [kg] > 0 reduced mass of the bodies that meet, at
// the line of action (angular mesh: kg m^2): a parameter, for a law knows nothing of the gears; another mass
// gives another e. An impact has the same e at every speed. (2.24) is a fit: for 0.9, 0.8, 0.5, 0.2 the
// impact gives 0.900, 0.799, 0.495, 0.192 (jankowski_restitution of model/restitution.h).
#include "backlash_diagnosis/model/restitution.h"
#include "laws.h"
#include "power.h"

namespace backlash::model {
namespace {

class Jankowski : public PowerElastic {
 public:
  Jankowski(double stiffness, double restitution, double effective_mass)
      : PowerElastic(stiffness, 1.5),
        damping_(2 * jankowski_damping_ratio(restitution) * std::sqrt(stiffness * effective_mass)) {}
  double force(double d, double rate, double) const override {
    const double elastic = spring(d);
    return rate > 0 ? elastic + damping_ * std::sqrt(std::sqrt(d)) * rate : elastic;
  }

 private:
  double damping_;  // c / d^(1/4)
};

}  // namespace

ContactLawType jankowski_contact() {
  return {"jankowski",
          {{"stiffness", "N/m^1.5", Range::positive(), "K"},
           {"restitution", "1", Range{0, 1, true}, "e"},
           {"effective_mass", "kg", Range::positive(), "m1 m2 / (m1 + m2) at the line of action"}},
          [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
            return std::make_unique<Jankowski>(p.at("stiffness"), p.at("restitution"),
                                               p.at("effective_mass"));
          }};
}

}  // namespace backlash::model
