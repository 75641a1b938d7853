// SPDX-License-Identifier: BSD-3-Clause
// Elastic contact with the damping of a viscous layer (foundation), clamped so that it never pulls:
//   F = max(0, K d^n + lambda d d'),  lambda = 2 pi R (eta / h) g1 / (g1 + g2)
// Yumrukcal (2013), Eq. 2.20: a sphere of radius R [m] > 0 pressed by d into a layer of thickness h [m] > 0
// and viscosity eta [Pa s] >= 0 touches the area 2 pi R d, on which the layer presses with eta d' / h; the
// share g1 / (g1 + g2), 0 to 1, is that of the layer in the deformation. For d well below R and h, and for
// lengths only: not for a rig without base radius. The source gives the damping force alone; the elastic
// part, which it leaves open, is here that of the other laws, K [N/m^n] > 0, 1 <= n <= 1.5. With n = 1 the
// restitution is that of Hunt and Crossley's law with D = lambda v / K, and an impact of small loss loses
// 2/3 lambda v d_max^2, with the cube of the deepest penetration. With n > 1 the clamp acts in the last
// moment of every impact.
#include <algorithm>

#include "laws.h"
#include "power.h"

namespace backlash::model {
namespace {

class Foundation : public PowerElastic {
 public:
  Foundation(double stiffness, double exponent, double damping)
      : PowerElastic(stiffness, exponent), damping_(damping) {}
  double force(double d, double rate, double) const override {
    return std::max(0.0, spring(d) + damping_ * d * rate);
  }

 private:
  double damping_;  // lambda [N s/m^2]
};

}  // namespace

ContactLawType foundation_contact() {
  return {"foundation",
          {power_stiffness(),
           power_exponent(),
           {"radius", "m", Range::positive(), "R"},
           {"viscosity", "Pa s", Range::not_negative(), "eta of the layer"},
           {"thickness", "m", Range::positive(), "h of the layer"},
           {"share", "1", Range::between(0, 1), "g1 / (g1 + g2)"}},
          [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
            return std::make_unique<Foundation>(
                p.at("stiffness"), p.at("exponent"),
                2 * M_PI * p.at("radius") * p.at("viscosity") / p.at("thickness") * p.at("share"));
          }};
}

}  // namespace backlash::model
