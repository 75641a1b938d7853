// SPDX-License-Identifier: BSD-3-Clause
// Dry friction in proportion to the torque that the teeth carry (loss of the gear under load):
//   added friction = mu |T|        mu [-], T torque through the mesh [N m]
// Of one inertia (mesh: rigid) T is what the load takes, J a less the torques of its terms (GearTrain).
// Hamon, Gautier and Garrec (2010, IROS), "Dynamic identification of robots with a dry friction model
// depending on load and velocity". A loss is never negative, and below 1 something arrives at the load.
#include <cmath>

#include "end_of_train.h"
#include "terms.h"

namespace backlash::model {
namespace {

class LoadDependentFriction : public EndFrictionTerm {
 public:
  explicit LoadDependentFriction(const ParameterValues& p)
      : EndFrictionTerm(p), coefficient_(p.at("coefficient")) {}
  bool follows_mesh_torque() const override { return true; }
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
          {body_parameter(),
           {"coefficient", "-", Range::between(0, 0.95), "mu, friction per torque through the mesh"}},
          [](const ParameterValues& p) -> std::unique_ptr<Term> {
            return std::make_unique<LoadDependentFriction>(p);
          },
          TermSearch{"coefficient", "", clear_coefficient, {}}};
}

}  // namespace backlash::model
