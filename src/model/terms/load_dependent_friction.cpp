// SPDX-License-Identifier: BSD-3-Clause
// Dry friction in proportion to the torque that the teeth carry (loss of the gear under load):
//   added friction = mu |T|        mu [-], T torque through the mesh [N m]; of a rigid mesh that of the motor
// Hamon, Gautier and Garrec (2010, IROS), "Dynamic identification of robots with a dry friction model
// depending on load and velocity". mu < 0: friction falls under load; the sum of all is never below 0.
#include <cmath>

#include "end_of_train.h"
#include "terms.h"

namespace backlash::model {
namespace {

class LoadDependentFriction : public EndFrictionTerm {
 public:
  explicit LoadDependentFriction(const ParameterValues& p)
      : EndFrictionTerm(p), coefficient_(p.at("coefficient")) {}
  void add_friction(const Motion& motion, EndFriction& friction) const override {
    end_.rub(coefficient_ * std::fabs(motion.mesh_torque), friction);
  }

 private:
  double coefficient_;
};

double clear_coefficient(const MotionRange&) {
  return 0.05;
}

}  // namespace

TermType load_dependent_friction_term() {
  return {"load_dependent_friction",
          {body_parameter(), {"coefficient", "-", Range::any(), "mu, friction per torque through the mesh"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<LoadDependentFriction>(p);
          },
          TermSearch{"coefficient", "", clear_coefficient, {}}};
}

}  // namespace backlash::model
