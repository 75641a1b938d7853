// SPDX-License-Identifier: BSD-3-Clause
// Dry friction that varies with the position:
//   added friction = A sin(n q + p)        A [N m], q position of the body, n periods per turn of the load
// (motor positions are those at the load side). Armstrong-Helouvry, Dupont and Canudas de Wit (1994,
// Automatica 30:1083) name the loading of gear teeth as cause.
#include <cmath>

#include "end_of_train.h"
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class PositionDependentFriction : public EndFrictionTerm {
 public:
  explicit PositionDependentFriction(const ParameterValues& p)
      : EndFrictionTerm(p), amplitude_(p.at("amplitude")), order_(p.at("order")), phase_(p.at("phase")) {}
  void add_friction(const Motion& motion, EndFriction& friction) const override {
    end_.rub(amplitude_ * std::sin(order_ * end_.position(motion) + phase_), friction);
  }

 private:
  double amplitude_, order_, phase_;
};

WaveMoment with_direction(const Motion& m, const ParameterValues& choices) {
  const EndOfTrain end(choices);
  const double speed = end.velocity(m);
  return {end.position(m), speed, speed == 0 ? 0 : std::copysign(1.0, speed)};
}

}  // namespace

TermType position_dependent_friction_term() {
  return {"position_dependent_friction",
          {body_parameter(),
           {"amplitude", "N m", Range::any(), "A"},
           {"order", "1/rad", Range::positive(), "n, periods per load turn"},
           {"phase", "rad", Range::any(), "p"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<PositionDependentFriction>(p);
          },
          TermSearch{"amplitude", "phase", clear_torque, {order_shape({false, with_direction})}}};
}

}  // namespace backlash::model
