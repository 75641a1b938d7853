// SPDX-License-Identifier: BSD-3-Clause
// Stribeck effect: dry friction is larger at low speed,
//   added friction = A exp(-|w / ws|^e)        A [N m], ws [rad/s] > 0, w speed of the body, at rest A
// e = 2 (Gaussian) or e = 1 (Tustin); Armstrong-Helouvry, Dupont and Canudas de Wit (1994, Automatica
// 30:1083) compare the forms. A >= 0: friction that grows from low speeds on is another effect
// (square_root_friction).
#include <cmath>

#include "end_of_train.h"
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class Stribeck : public EndFrictionTerm {
 public:
  explicit Stribeck(const ParameterValues& p)
      : EndFrictionTerm(p), torque_(p.at("torque")), speed_(p.at("speed")), exponent_(p.at("exponent")) {}
  void add_friction(const Motion& motion, EndFriction& friction) const override {
    const double w = std::fabs(end_.velocity(motion)) / speed_;
    end_.rub(torque_ * std::exp(-std::pow(w, exponent_)), friction);
  }

 private:
  double torque_, speed_, exponent_;
};

/// Speeds tried: from so slow that the effect acts at rest only to so fast that it acts at all speeds.
std::vector<double> speeds(const MotionRange& range) {
  std::vector<double> all;
  for (double share = 0.01; share < 1; share *= 2) all.push_back(share * range.speed);
  return all;
}

std::vector<double> exponents(const MotionRange&) {
  return {1, 2};
}

}  // namespace

TermType stribeck_term() {
  return {"stribeck",
          {body_parameter(),
           {"torque", "N m", Range::not_negative(), "A, added at rest"},
           {"speed", "rad/s", Range::positive(), "ws, of the decay"},
           {"exponent", "-", Range::between(0.1, 10), "e", false, {}, 2}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> { return std::make_unique<Stribeck>(p); },
          TermSearch{"torque", "", clear_torque, {{"speed", speeds, true}, {"exponent", exponents, false}}}};
}

}  // namespace backlash::model
