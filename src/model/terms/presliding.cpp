// Dry friction of a body builds up over a distance x_s [rad at the load] after each reversal, instead of at
// once: Dahl's law, see presliding.h. The limits that it tends to are those of the body and of the other
// terms.
#include <algorithm>

#include "terms.h"

namespace backlash {
namespace {

class PreslidingTerm : public Term {
 public:
  PreslidingTerm(bool of_motor, double distance) : of_motor_(of_motor), distance_(distance) {}
  bool has_dry_friction() const override { return true; }
  void add_friction(const Motion&, EndFriction& friction) const override {
    (of_motor_ ? friction.motor : friction.load).presliding += distance_;
  }
  bool moves_load() const override { return !of_motor_; }

 private:
  bool of_motor_;
  double distance_;
};

/// Friction is then building up for some percent of the way.
double typical(const MotionRange& range) {
  constexpr double kShortest = 1e-9;  // rad
  return std::max(0.01 * (range.to - range.from), kShortest);
}

}  // namespace

TermType presliding_term() {
  return {"presliding",
          {{"body", "-", Range::any(), "whose friction it is", false, {"motor", "load"}},
           {"distance", "rad", Range::not_negative(), "x_s, at the load"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<PreslidingTerm>(p.choice("body") == "motor", p.at("distance"));
          },
          TermSearch{"distance", "", typical, {}}};
}

}  // namespace backlash
