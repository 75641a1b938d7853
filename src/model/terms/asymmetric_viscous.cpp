// SPDX-License-Identifier: BSD-3-Clause
// Viscous friction that differs between the directions:
//   torque = -a |w|        a [N m s/rad]: damping c + a forward, c - a backward, w speed of the body
// Where a exceeds the damping of the machine a direction is driven instead of braked. Yumrukcal (2013, Table
// 5.2) measured 13.7 and 11.5 N m s/rad on the driver of his rig.
#include <cmath>

#include "end_of_train.h"
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class AsymmetricViscous : public EndTorqueTerm {
 public:
  explicit AsymmetricViscous(const ParameterValues& p) : EndTorqueTerm(p), damping_(p.at("damping")) {}
  void add(const Motion& motion, EndTorques& ends) const override {
    end_.torque(ends) -= damping_ * std::fabs(end_.velocity(motion));
  }

 private:
  double damping_;
};

double clear_damping(const MotionRange& range) {
  return clear_torque(range) / range.speed;
}

}  // namespace

TermType asymmetric_viscous_term() {
  return {
      "asymmetric_viscous",
      {body_parameter(), {"damping", "N m s/rad", Range::any(), "a, half the difference of the directions"}},
      [](const ParameterValues& p) -> std::unique_ptr<Term> {
        return std::make_unique<AsymmetricViscous>(p);
      },
      TermSearch{"damping", "", clear_damping, {}}};
}

}  // namespace backlash::model
