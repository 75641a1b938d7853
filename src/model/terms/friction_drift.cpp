// SPDX-License-Identifier: BSD-3-Clause
// Dry friction that changes as the machine runs (warms up):
//   added friction = A (1 - exp(-r t)) / (1 - exp(-r S))        A [N m] at t = S [s], r [1/s], t time
// With a time constant tau = 1 / r: A_end (1 - exp(-t / tau)), A_end = A / (1 - exp(-r S)). Of A_end and tau
// a slow drift (tau >> S) determines only the ratio; A is the change over the span S whatever r, and r goes
// through 0, where the drift is linear, A t / S, to r < 0, where it gets faster. Bittencourt and Gunnarsson
// (2012, J. Dyn. Syst. Meas. Control 134:051013) measured such changes with temperature on robot joints.
#include <cmath>

#include "end_of_train.h"
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

/// (1 - exp(-r t)) / (1 - exp(-r s)), without overflow for t <= s.
double share_at(double t, double s, double r) {
  if (r == 0) return t / s;
  if (r > 0) return std::expm1(-r * t) / std::expm1(-r * s);
  return std::exp(-r * (t - s)) * std::expm1(r * t) / std::expm1(r * s);
}

class FrictionDrift : public EndFrictionTerm {
 public:
  explicit FrictionDrift(const ParameterValues& p)
      : EndFrictionTerm(p), change_(p.at("change")), span_(p.at("span")), rate_(p.at("rate")) {}
  void add_friction(const Motion& motion, EndFriction& friction) const override {
    end_.rub(change_ * share_at(motion.time, span_, rate_), friction);
  }

 private:
  double change_, span_, rate_;
};

std::vector<double> span(const MotionRange& range) {
  return {range.duration};
}

std::vector<double> rates(const MotionRange& range) {
  return {0.3 / range.duration, 1 / range.duration, 3 / range.duration, 10 / range.duration};
}

}  // namespace

TermType friction_drift_term() {
  return {
      "friction_drift",
      {body_parameter(),
       {"change", "N m", Range::any(), "A, of the friction over the span"},
       {"span", "s", Range::positive(), "S, from time 0"},
       {"rate", "1/s", Range::any(), "r, 1 / time constant; 0: linear"}},
      [](const ParameterValues& p) -> std::unique_ptr<Term> { return std::make_unique<FrictionDrift>(p); },
      TermSearch{"change", "", clear_torque, {{"span", span, false}, {"rate", rates, true}}}};
}

}  // namespace backlash::model
