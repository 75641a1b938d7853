// SPDX-License-Identifier: BSD-3-Clause
// Gravity on a link whose centre of mass lies off the axis:
//   load torque = -A sin(q + p)        A = m g d [N m], p [rad], q = load position, q + p = 0 hanging down
// Sarkar, Ellis and Moore (1997), Table 1 (m_L d_L sin(theta_L) g).
#include <cmath>

#include "backlash_diagnosis/model/weight_term.h"
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class Gravity : public Term {
 public:
  Gravity(double amplitude, double phase) : amplitude_(amplitude), phase_(phase) {}
  void add(const Motion& motion, EndTorques& torques) const override {
    torques.load -= amplitude_ * std::sin(motion.load_position + phase_);
  }

 private:
  double amplitude_, phase_;
};

}  // namespace

const std::string& weight_term() {
  static const std::string id = "gravity";
  return id;
}

TermType gravity_term() {
  TermType type{weight_term(),
                {{"amplitude", "N m", Range::not_negative(), "A"}, {"phase", "rad", Range::any(), "p"}},
                [](const ParameterValues& p) -> std::unique_ptr<Term> {
                  return std::make_unique<Gravity>(p.at("amplitude"), p.at("phase"));
                },
                TermSearch{"amplitude", "phase", clear_torque, {}}};
  type.usual_of_weight = kUsualOfWeight;
  return type;
}

}  // namespace backlash::model
