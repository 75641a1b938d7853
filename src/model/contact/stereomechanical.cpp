// SPDX-License-Identifier: BSD-3-Clause
// Rigid impact as the reference: at a touch faster than `resting_speed` [m/s] > 0 the speeds jump,
//   (v1' - v2') = -e (v1 - v2), momentum conserved        0 <= e <= 1
// (Yumrukcal 2013, Eqs. 2.15 and 2.16; speeds_after_impact() of model/restitution.h). Slower touches do not
// jump; the flanks then rest on a spring and damper until they part:
//   F = max(0, K d + c d')        K [N/m] > 0, c [N s/m] >= 0
// so that a flank that bounces under load comes to rest after ln(v / resting_speed) / ln(1/e) jumps instead
// of after infinitely many (the static contact speed threshold of Simscape's hard stop based on the
// coefficient of restitution). A contact that no touch began rests too, and so does a mesh without any
// backlash: it has no room to bounce.
#include <algorithm>

#include "laws.h"
#include "power.h"

namespace backlash::model {
namespace {

class Stereomechanical : public PowerElastic {
 public:
  Stereomechanical(double restitution, double resting_speed, double stiffness, double damping)
      : PowerElastic(stiffness, 1),
        restitution_(restitution),
        resting_speed_(resting_speed),
        damping_(damping) {}
  bool needs_impact_speed() const override { return true; }
  std::optional<double> jump_restitution(double impact_speed) const override {
    if (impact_speed <= resting_speed_) return std::nullopt;
    return restitution_;
  }
  double force(double d, double rate, double) const override {
    return std::max(0.0, spring(d) + damping_ * rate);
  }

 private:
  double restitution_, resting_speed_, damping_;
};

}  // namespace

ContactLawType stereomechanical_contact() {
  return {"stereomechanical",
          {{"restitution", "1", Range::between(0, 1), "e"},
           {"resting_speed", "m/s", Range::positive(), "slower touches do not bounce"},
           {"stiffness", "N/m", Range::positive(), "K at rest"},
           {"damping", "N s/m", Range::not_negative(), "c at rest"}},
          [](const ParameterValues& p) -> std::unique_ptr<ContactLaw> {
            return std::make_unique<Stereomechanical>(p.at("restitution"), p.at("resting_speed"),
                                                      p.at("stiffness"), p.at("damping"));
          }};
}

}  // namespace backlash::model
