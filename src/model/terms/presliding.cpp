// SPDX-License-Identifier: BSD-3-Clause
// Dry friction of a body builds up over a distance x_s [rad at the load] after each reversal, instead of at
// once: Dahl's law, with damping that of LuGre, see presliding.h. The limits that it tends to are those of
// the body and of the other terms.
#include <algorithm>

#include "terms.h"

namespace backlash::model {
namespace {

class PreslidingTerm : public Term {
 public:
  PreslidingTerm(bool of_motor, double distance, double damping)
      : of_motor_(of_motor), distance_(distance), damping_(damping) {}
  bool has_dry_friction() const override { return true; }
  void add_friction(const Motion&, EndFriction& friction) const override {
    FrictionLimits& limits = of_motor_ ? friction.motor : friction.load;
    limits.presliding += distance_;
    limits.presliding_damping += damping_;
  }
  bool moves_load() const override { return !of_motor_; }

 private:
  bool of_motor_;
  double distance_, damping_;
};

/// Friction is then building up for some percent of the way.
double typical(const MotionRange& range) {
  constexpr double kShortest = 1e-9;  // rad
  return std::max(0.01 * (range.to - range.from), kShortest);
}

/// From what does not show, as in Dahl's law, to what brakes like a wall.
std::vector<double> dampings(const MotionRange& range) {
  const double clear = range.speed > 0 ? range.torque / range.speed : 1;
  return {1e-3 * clear, 3 * clear, 20 * clear};
}

}  // namespace

TermType presliding_term() {
  TermType type{
      "presliding",
      {{"body", "-", Range::any(), "whose friction it is", false, {"motor", "load"}},
       {"distance", "rad", Range::not_negative(), "x_s, at the load"},
       {"damping", "N m s/rad", Range::not_negative(), "of the bristles; 0: Dahl's law", false, {}, 0}},
      [](const ParameterValues& p) -> std::unique_ptr<Term> {
        return std::make_unique<PreslidingTerm>(p.choice("body") == "motor", p.at("distance"),
                                                p.at("damping"));
      },
      TermSearch{"distance", "", typical, {{"damping", dampings, true}}}};
  type.shapes_friction = true;
  type.usual_of_gap = 1;  // choice: bristles are shorter than the play; a path beyond it is a soft part
  return type;
}

}  // namespace backlash::model
