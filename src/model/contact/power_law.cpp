// Elastic contact without loss:
//   F = K d^n        K [N/m^n] > 0, 1 <= n <= 1.5
// n = 1 for line contact, 3/2 for point contact (Hertz), in between for gear teeth.
// Sarkar, Ellis and Moore (1997), Eq. 10, after Hunt and Crossley (1975).
#include "laws.h"
#include "power.h"

namespace backlash {
namespace {

class PowerLaw : public ContactLaw {
 public:
  PowerLaw(double stiffness, double exponent) : stiffness_(stiffness), exponent_(exponent) {}
  double force(double d, double) const override { return stiffness_ * contact_power(d, exponent_); }
  double elastic_energy(double d) const override { return d * force(d, 0) / (exponent_ + 1); }
  double static_penetration(double force) const override { return std::pow(force / stiffness_, 1 / exponent_); }

 private:
  double stiffness_, exponent_;
};

}  // namespace

ContactLawType power_law_contact() {
  return {"power_law",
          {{"stiffness", "N/m^n", Range::positive(), "K"}, {"exponent", "1", Range::between(1, 1.5), "n"}},
          [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
            return std::make_unique<PowerLaw>(p.at("stiffness"), p.at("exponent"));
          }};
}

}  // namespace backlash
