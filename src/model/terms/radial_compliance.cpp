// SPDX-License-Identifier: BSD-3-Clause
// The separating force of the teeth presses the wheels apart: with the torque T through the mesh the centre
// distance grows by dC = h |T| tan(phi) / r and either flank recedes along the line of action by dC sin(phi),
//   o = dC sin(phi) / r_b = h |T| sin(phi)^2 / r_b^2     opening [rad at the load]
// h radial compliance [m/N], r_b base radius of the load gear [m], phi pressure angle, r = r_b / cos(phi). It
// acts like a spring in series with the mesh, r_b^2 / (h sin(phi)^2) [N m/rad]. The structural compliance
// that Yumrukcal (2013, Section 6.2.1) suspects behind a residual that follows the force; an involute pair
// keeps its ratio at any centre distance.
#include <cmath>

#include "terms.h"

namespace backlash::model {
namespace {

class RadialCompliance : public Term {
 public:
  RadialCompliance(double compliance, double base_radius, double pressure_angle)
      : opening_(compliance * std::pow(std::sin(pressure_angle) / base_radius, 2)) {}
  bool shapes_flanks() const override { return true; }
  bool shape_follows_torque() const override { return true; }
  void shape(const FlankPoint& at, FlankShift& shift) const override {
    shift.opening += opening_ * std::fabs(at.mesh_torque);
  }

 private:
  double opening_;  // rad per N m
};

}  // namespace

TermType radial_compliance_term() {
  return {"radial_compliance",
          {{"compliance", "m/N", Range::not_negative(), "h, of the centre distance"},
           {"base_radius", "m", Range::positive(), "r_b, of the load gear"},
           {"pressure_angle", "rad", Range::between(0, 1), "phi"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<RadialCompliance>(p.at("compliance"), p.at("base_radius"),
                                                      p.at("pressure_angle"));
          }};
}

}  // namespace backlash::model
