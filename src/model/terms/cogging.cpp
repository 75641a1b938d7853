// SPDX-License-Identifier: BSD-3-Clause
// Cogging: teeth of the motor's stator pull at its magnets,
//   motor torque = -A sin(n q + p)        A [N m], q = motor position at the load side, n periods per turn of
// it, hence periods per motor turn times the reduction ratio. Conservative. Holtz and Springob (1996, IEEE
// Trans. Ind. Electron. 43) give the cause and the harmonics.
#include <cmath>

#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class Cogging : public Term {
 public:
  Cogging(double amplitude, double order, double phase)
      : amplitude_(amplitude), order_(order), phase_(phase) {}
  bool moves_load() const override { return false; }
  void add(const Motion& motion, EndTorques& torques) const override {
    torques.motor -= amplitude_ * std::sin(order_ * motion.motor_position + phase_);
  }

 private:
  double amplitude_, order_, phase_;
};

WaveMoment over_motor_position(const Motion& m, const ParameterValues&) {
  return {m.motor_position, m.motor_velocity, 1};
}

}  // namespace

TermType cogging_term() {
  TermType type{"cogging",
                {{"amplitude", "N m", Range::any(), "A, at the load side"},
                 {"order", "1/rad", Range::positive(), "n, periods per turn of the motor position"},
                 {"phase", "rad", Range::any(), "p"}},
                [](const ParameterValues& p) -> std::unique_ptr<Term> {
                  return std::make_unique<Cogging>(p.at("amplitude"), p.at("order"), p.at("phase"));
                },
                TermSearch{"amplitude", "phase", clear_torque, {order_shape({false, over_motor_position})}}};
  type.usual_of_weight = kUsualOfWeight;
  return type;
}

}  // namespace backlash::model
