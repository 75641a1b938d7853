// SPDX-License-Identifier: BSD-3-Clause
// Drag of turbulent air or oil (windage, churning):
//   torque = -A w |w|        A [N m s^2/rad^2], w speed of the body
// A < 0 beside a viscous friction: friction that grows less than the speed, as the rig of Yumrukcal (2013,
// Table B.3) seems to have going forward. The quadratic form is that of any body in turbulent flow.
#include <cmath>

#include "end_of_train.h"
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class QuadraticDrag : public EndTorqueTerm {
 public:
  explicit QuadraticDrag(const ParameterValues& p) : EndTorqueTerm(p), drag_(p.at("drag")) {}
  void add(const Motion& motion, EndTorques& ends) const override {
    const double w = end_.velocity(motion);
    end_.torque(ends) -= drag_ * w * std::fabs(w);
  }

 private:
  double drag_;
};

double clear_drag(const MotionRange& range) {
  return clear_torque(range) / (range.speed * range.speed);
}

}  // namespace

TermType quadratic_drag_term() {
  return {
      "quadratic_drag",
      {body_parameter(), {"drag", "N m s^2/rad^2", Range::not_negative(), "A"}},
      [](const ParameterValues& p) -> std::unique_ptr<Term> { return std::make_unique<QuadraticDrag>(p); },
      TermSearch{"drag", "", clear_drag, {}}};
}

}  // namespace backlash::model
