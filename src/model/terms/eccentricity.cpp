// SPDX-License-Identifier: BSD-3-Clause
// A wheel that runs out of true by eps [m]: along the line of action, at pressure angle phi, the flank of
// side s = +-1 moves by eps sin(a - s phi) with the angle a = n q + p of its high spot, that is
//   o_s = eps / r_b (sin(phi) cos(a) - s cos(phi) sin(a))      opening [rad at the load], r_b base radius of
//   the load gear
// The part with s is a transmission error of amplitude eps / r (r pitch radius), the other a backlash that
// varies by 2 eps tan(phi) / r: a change of centre distance by eps cos(a) (Yumrukcal 2013, Eqs. A.2 and A.3,
// names eccentric wheels as cause of the varying backlash and does not model them). q = load position; n = 1
// for the load gear, the tooth ratio for the pinion.
#include <cmath>

#include "terms.h"

namespace backlash::model {
namespace {

class Eccentricity : public Term {
 public:
  Eccentricity(double radial, double base_radius, double pressure_angle, double order, double phase)
      : opening_(radial / base_radius), phi_(pressure_angle), order_(order), phase_(phase) {}
  bool shapes_flanks() const override { return true; }
  void shape(const FlankPoint& at, FlankShift& shift) const override {
    const double angle = order_ * at.load_position + phase_ - at.side * phi_;
    shift.opening -= at.side * opening_ * std::sin(angle);
    shift.load_slope -= at.side * opening_ * order_ * std::cos(angle);
  }

 private:
  double opening_, phi_, order_, phase_;
};

}  // namespace

TermType eccentricity_term() {
  return {"eccentricity",
          {{"eccentricity", "m", Range::not_negative(), "eps, of the wheel's centre from its axis"},
           {"base_radius", "m", Range::positive(), "r_b, of the load gear"},
           {"pressure_angle", "rad", Range::between(0, 1), "phi"},
           {"order", "-", Range::positive(), "n, turns of the wheel per turn of the load"},
           {"phase", "rad", Range::any(), "p"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<Eccentricity>(p.at("eccentricity"), p.at("base_radius"),
                                                  p.at("pressure_angle"), p.at("order"), p.at("phase"));
          }};
}

}  // namespace backlash::model
