// SPDX-License-Identifier: BSD-3-Clause
// Linear spring and damper (Kelvin-Voigt), clamped so that it never pulls:
//   F = max(0, K d + c d')        K [N/m] > 0, c [N s/m] >= 0
// With c = 0 it is the line contact of Sarkar, Ellis and Moore (1997), Eq. 9. With c > 0 the force jumps by c
// d' at first touch, the known objection to the Kelvin-Voigt element (Hunt and Crossley 1975); the tension at
// the end of the loop is clamped to zero (`kelvin_voigt` keeps it).
#include <algorithm>

#include "laws.h"

namespace backlash::model {
namespace {

class Linear : public ContactLaw {
 public:
  Linear(double stiffness, double damping) : stiffness_(stiffness), damping_(damping) {}
  double force(double d, double rate, double) const override {
    return std::max(0.0, stiffness_ * d + damping_ * rate);
  }
  std::optional<PowerContact> power_contact() const override {
    return PowerContact{stiffness_, 1, 0, damping_};
  }
  double elastic_energy(double d) const override { return 0.5 * stiffness_ * d * d; }
  double static_penetration(double force) const override { return force / stiffness_; }

 private:
  double stiffness_, damping_;
};

}  // namespace

ContactLawType linear_contact() {
  return {"linear",
          {{"stiffness", "N/m", Range::positive(), "K"}, {"damping", "N s/m", Range::not_negative(), "c"}},
          [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
            return std::make_unique<Linear>(p.at("stiffness"), p.at("damping"));
          }};
}

}  // namespace backlash::model
