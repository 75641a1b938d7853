// SPDX-License-Identifier: BSD-3-Clause
// Teeth that rub on each other, and material that does: a flank bears more while it is pressed together than
// while it lets go,
//   flank torque * (1 + h d' / (|d'| + v))        h [-], d' rate of the penetration, v [rad/s at the load]
// v > 0 is the speed within which the difference turns; so the loss does not depend on the speed, unlike that
// of a damper. All teeth have some per cent, as in the fit of the waveform; strain wave gears have more.
#include <cmath>

#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class MeshHysteresis : public Term {
 public:
  MeshHysteresis(double share, double speed) : share_(share), speed_(speed) {}
  bool loads_flanks() const override { return true; }
  void load_flank(const FlankLoad& load, double& torque) const override {
    torque *= 1 + share_ * load.rate / (std::fabs(load.rate) + speed_);
  }

 private:
  double share_, speed_;
};

double clear_share(const MotionRange&) {
  return 0.1;
}

/// Where a fit begins; choice: flanks close a hundred times as slowly as the joint moves.
std::vector<double> closing_speeds(const MotionRange& range) {
  return {0.01 * range.speed};
}

}  // namespace

TermType mesh_hysteresis_term() {
  TermType type{"mesh_hysteresis",
                {{"share", "-", Range::between(-0.9, 0.9), "h"},
                 {"speed", "rad/s", Range::positive(), "v, at the load"}},
                [](const ParameterValues& p) -> std::unique_ptr<Term> {
                  return std::make_unique<MeshHysteresis>(p.at("share"), p.at("speed"));
                },
                TermSearch{"share", "", clear_share, {{"speed", closing_speeds, true}}}};
  type.usual_share = 0.15;  // choice: what even a strain wave gear may lose
  return type;
}

}  // namespace backlash::model
