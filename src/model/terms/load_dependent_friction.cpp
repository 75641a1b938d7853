// SPDX-License-Identifier: BSD-3-Clause
// Dry friction in proportion to the torque that the teeth carry (loss of the gear under load):
//   added friction = mu |T|        mu [-], T torque through the mesh [N m]
// Of one inertia (mesh: rigid) T is what the load takes, (1 - r) J a less the torques of its terms
// (GearTrain), with r the share of J that is the motor's rotor, which loads no teeth. Hamon, Gautier and
// Garrec (2010, IROS), "Dynamic identification of robots with a dry friction model depending on load and
// velocity". mu is not negative, and below 1: a part of the torque arrives at the load.
//
// What the load takes may fluctuate faster than a record shows (teeth, rollers, stick and slip in the
// bearings), more and more from a speed on: of T + n with n even within +-a,
//   a = k max(0, |w| - w0)        k [N m s/rad], w0 [rad/s], w speed of the body
// the mean loss is mu times
//   <|T + n|> = |T| where |T| >= a, else (T^2 + a^2) / (2 a)
// which at high speed no longer knows the sign of T. k = 0, the usual case, is the law above.
#include <algorithm>
#include <cmath>

#include "end_of_train.h"
#include "terms.h"

namespace backlash::model {
namespace {

class LoadDependentFriction : public EndFrictionTerm {
 public:
  explicit LoadDependentFriction(const ParameterValues& p)
      : EndFrictionTerm(p),
        coefficient_(p.at("coefficient")),
        fluctuation_(p.at("fluctuation")),
        speed_(p.at("fluctuation_speed")),
        rotor_share_(p.at("rotor_share")) {}
  bool follows_mesh_torque() const override { return true; }
  double rotor_share() const override { return rotor_share_; }
  void add_friction(const Motion& motion, EndFriction& friction) const override {
    const double t = std::fabs(motion.mesh_torque);
    const double a = fluctuation_ * std::max(0.0, std::fabs(end_.velocity(motion)) - speed_);
    end_.rub(coefficient_ * (t >= a ? t : (t * t + a * a) / (2 * a)), friction);
  }

 private:
  double coefficient_, fluctuation_, speed_, rotor_share_;
};

std::vector<double> fluctuations(const MotionRange& range) {
  return {5 * range.torque / range.speed};
}

std::vector<double> fluctuation_speeds(const MotionRange& range) {
  return {0.3 * range.speed, range.speed};
}

std::vector<double> rotor_shares(const MotionRange&) {
  return {0.5};
}

double clear_coefficient(const MotionRange&) {
  return 0.05;
}

}  // namespace

TermType load_dependent_friction_term() {
  return {"load_dependent_friction",
          {body_parameter(),
           {"coefficient", "-", Range::between(0, 0.95), "mu, friction per torque through the mesh"},
           {"fluctuation", "N m s/rad", Range::not_negative(), "k, of the torque, per speed", false, {}, 0},
           {"fluctuation_speed", "rad/s", Range::not_negative(), "w0, where it begins", false, {}, 0},
           {"rotor_share", "-", Range::between(0, 1), "r, of one inertia before the teeth", false, {}, 0}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<LoadDependentFriction>(p);
          },
          TermSearch{"coefficient",
                     "",
                     clear_coefficient,
                     {{"rotor_share", rotor_shares, true, std::nullopt, 1, true},
                      {"fluctuation", fluctuations, true, std::nullopt, 2},
                      {"fluctuation_speed", fluctuation_speeds, true, std::nullopt, 2}}}};
}

}  // namespace backlash::model
