// SPDX-License-Identifier: BSD-3-Clause
// Elastic contact with damping proportional to the elastic force, clamped so that it never pulls:
//   F = max(0, K d^n (1 + 3/2 alpha d'))        K [N/m^n] > 0, 1 <= n <= 1.5, alpha [s/m] >= 0
// The restitution of an impact at approach speed v is e = 1 - alpha v to first order in alpha v (Hunt and
// Crossley 1975; Sarkar, Ellis and Moore 1997, Eqs. 10 to 12). Exactly, with D = 3/2 alpha v: D (1+e) =
// ln((1+D)/(1-e D)). Valid for alpha v well below 1. The clamp acts only at d' < -2/(3 alpha), faster than
// any free rebound.
#include <algorithm>

#include "laws.h"
#include "power.h"

namespace backlash::model {
namespace {

class HuntCrossley : public PowerElastic {
 public:
  HuntCrossley(double stiffness, double exponent, double alpha)
      : PowerElastic(stiffness, exponent), loss_(1.5 * alpha) {}
  double force(double d, double rate, double) const override {
    return spring(d) * std::max(0.0, 1 + loss_ * rate);
  }
  std::optional<PowerContact> power_contact() const override {
    PowerContact numbers = elastic();
    numbers.loss = loss_;
    return numbers;
  }

 private:
  double loss_;
};

}  // namespace

ContactLawType hunt_crossley_contact() {
  return {"hunt_crossley",
          {power_stiffness(),
           power_exponent(),
           {"alpha", "s/m", Range::not_negative(), "restitution loss per approach speed"}},
          [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
            return std::make_unique<HuntCrossley>(p.at("stiffness"), p.at("exponent"), p.at("alpha"));
          }};
}

}  // namespace backlash::model
