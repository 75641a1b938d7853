// SPDX-License-Identifier: BSD-3-Clause
// Teeth that get stiffer, or softer (A < 0), the farther they are pressed together:
//   added flank torque = A (d / D)^e        A [N m] at the penetration D, d penetration, both [rad at the
// load], D > 0; that is h d^e with h = A / D^e. Softening takes at most half of what the flank bears without
// it: teeth that gave way altogether would let each other through. Conservative beside a law that is. e = 3
// is the cubic stiffness of Tuttle and Seering (1996, IEEE Trans. Robot. Autom. 12:368), e = 2 an even one.
#include <algorithm>
#include <cmath>

#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class MeshHardening : public Term {
 public:
  MeshHardening(double torque, double penetration, double exponent)
      : torque_(torque), penetration_(penetration), exponent_(exponent) {}
  bool loads_flanks() const override { return true; }
  void load_flank(const FlankLoad& load, double& torque) const override {
    const double added = torque_ * std::pow(load.penetration / penetration_, exponent_);
    torque += std::max(added, -0.5 * std::max(0.0, torque));
  }

 private:
  double torque_, penetration_, exponent_;
};

std::vector<double> penetrations(const MotionRange& range) {
  return {range.deflection};
}

std::vector<double> exponents(const MotionRange&) {
  return {1.5, 2, 3};  // Hertzian teeth, with the linear law grown soft; even; cubic
}

}  // namespace

TermType mesh_hardening_term() {
  TermType type{"mesh_hardening",
                {{"torque", "N m", Range::any(), "A"},
                 {"penetration", "rad", Range::positive(), "D, at the load, where A is added"},
                 {"exponent", "-", Range::between(1, 10), "e"}},
                [](const ParameterValues& p) -> std::unique_ptr<Term> {
                  return std::make_unique<MeshHardening>(p.at("torque"), p.at("penetration"),
                                                         p.at("exponent"));
                },
                TermSearch{"torque",
                           "",
                           clear_torque,
                           {{"penetration", penetrations, false}, {"exponent", exponents, false}}}};
  type.stands_in_for_contact_law = true;
  return type;
}

}  // namespace backlash::model
