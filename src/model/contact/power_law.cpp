// SPDX-License-Identifier: BSD-3-Clause
// Elastic contact without loss:
//   F = K d^n        K [N/m^n] > 0, 1 <= n <= 1.5
// n = 1 for line contact, 3/2 for point contact (Hertz), in between for gear teeth.
// Sarkar, Ellis and Moore (1997), Eq. 10, after Hunt and Crossley (1975).
#include "laws.h"
#include "power.h"

namespace backlash::model {
namespace {

class PowerLaw : public PowerElastic {
 public:
  using PowerElastic::PowerElastic;
  double force(double d, double, double) const override { return spring(d); }
  std::optional<PowerContact> power_contact() const override { return elastic(); }
};

}  // namespace

ContactLawType power_law_contact() {
  return {"power_law",
          {power_stiffness(), power_exponent()},
          [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
            return std::make_unique<PowerLaw>(p.at("stiffness"), p.at("exponent"));
          }};
}

}  // namespace backlash::model
