// SPDX-License-Identifier: BSD-3-Clause
// Friction that bends: it grows less and less with the speed,
//   added friction = A sqrt(|w|)        A [N m s^0.5/rad^0.5] >= 0, w speed of the body
// as lubricated contacts between dry and full film have it. Yumrukcal (2013, Table B.3) measured 67.9 + 30.5
// sqrt(w) forward, which a straight line misses by up to 3.3 N m.
#include <cmath>

#include "end_of_train.h"
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class SquareRootFriction : public EndFrictionTerm {
 public:
  explicit SquareRootFriction(const ParameterValues& p) : EndFrictionTerm(p), friction_(p.at("friction")) {}
  void add_friction(const Motion& motion, EndFriction& friction) const override {
    end_.rub(friction_ * std::sqrt(std::fabs(end_.velocity(motion))), friction);
  }

 private:
  double friction_;
};

double clear_friction(const MotionRange& range) {
  return clear_torque(range) / std::sqrt(range.speed);
}

}  // namespace

TermType square_root_friction_term() {
  return {"square_root_friction",
          {body_parameter(), {"friction", "N m s^0.5/rad^0.5", Range::not_negative(), "A"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<SquareRootFriction>(p);
          },
          TermSearch{"friction", "", clear_friction, {}}};
}

}  // namespace backlash::model
