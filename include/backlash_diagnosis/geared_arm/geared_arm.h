// SPDX-License-Identifier: BSD-3-Clause
// An arm whose joints have gears with play: the rig file of an arm with `gear`, `excitation` and
// `simulation`.
//
// Motor j, on its own side of the gap, and link side j, all seen from the joint's side of the reduction:
//   J_j a_M = tau_j - friction_j(v_M) - T_j,   T_j = s F(|phi| - b_j / 2, s phi'),
//   M(q) a + c(q, v) + g(q) = T - friction of the links,   phi = q_M - q_j,  s = sign(phi)
// F: a contact law over angles; b_j: the whole play. friction_j as arm/arm_rig.h and arm/joint_effect.h have
// it, the chain's own torque being T_j; without a distance over which it builds up. A joint without `gear`
// has its motor on the link, and no friction that follows the load. A joint that is `held` stays where it is.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/diagnosis/limits.h"
#include "backlash_diagnosis/model/contact_law.h"
#include "backlash_diagnosis/simulation/excitation.h"
#include "backlash_diagnosis/simulation/integrator.h"
#include "backlash_diagnosis/simulation/sensor_model.h"

namespace backlash::geared_arm {

struct Gear {
  double backlash = 0;                               // rad, >= 0, total
  std::shared_ptr<const model::ContactLaw> contact;  // over angles
};

struct GearedJoint {
  std::optional<Gear> gear;    // none: motor and link turn together
  std::optional<double> held;  // rad: the link is held there
  double start = 0;            // rad: where a joint that is not held begins; of a planned motion
  double link_coulomb = 0;     // N m, >= 0, friction behind the gap
  double link_viscous = 0;     // N m s/rad, >= 0
  simulation::ExcitationSettings excitation;  // of the motor; means nothing where the joint is held
  std::optional<diagnosis::Limits> limits;    // rad, of its play
};

struct GearedArm {
  arm::ArmRig rig;
  std::vector<GearedJoint> joints;      // in the order of the rig
  bool gravity_compensation = false;    // motors also give g(q_M), renewed where a controller samples
  simulation::SensorsSettings sensors;  // of each joint; the seed of joint j is seed + j
  simulation::SolverSettings solver;
  bool simulated = false;  // the file says how to run it: `simulation` is there
};

/// Throws MissingInput, BadData (file, line, key, value, limit), InvalidParameter.
GearedArm load_geared_arm(const std::string& path);
/// As arm::arm_rig_from_text().
GearedArm geared_arm_from_text(const std::string& text, const std::string& source, const std::string& folder);

}  // namespace backlash::geared_arm
