// SPDX-License-Identifier: BSD-3-Clause
// Spring and damper side by side, as the theory has it and not as teeth do:
//   F = K d + c d'        K [N/m] > 0, c [N s/m] >= 0
// The force jumps to c v at a touch with approach speed v (Yumrukcal 2013, Eqs. 2.13 and 2.14), and PULLS at
// the end of the loop, where d' < -K d / c: both are the known objections (Hunt and Crossley 1975; Sarkar,
// Ellis and Moore 1997, Section 4.2). `linear` is the same without the tension. Restitution of two bodies of
// reduced mass m, at any speed:
//   e = exp(-pi z / sqrt(1 - z^2)), z = c / (2 sqrt(K m)) < 1
// With z >= 1 they never part.
#include "laws.h"
#include "power.h"

namespace backlash::model {
namespace {

class KelvinVoigt : public PowerElastic {
 public:
  KelvinVoigt(double stiffness, double damping) : PowerElastic(stiffness, 1), damping_(damping) {}
  double force(double d, double rate, double) const override { return spring(d) + damping_ * rate; }

 private:
  double damping_;
};

}  // namespace

ContactLawType kelvin_voigt_contact() {
  return {"kelvin_voigt",
          {{"stiffness", "N/m", Range::positive(), "K"}, {"damping", "N s/m", Range::not_negative(), "c"}},
          [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
            return std::make_unique<KelvinVoigt>(p.at("stiffness"), p.at("damping"));
          }};
}

}  // namespace backlash::model
