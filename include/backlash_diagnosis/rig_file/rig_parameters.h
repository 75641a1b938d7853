// SPDX-License-Identifier: BSD-3-Clause
// The parameters of a rig that can be fitted to a record, each with its name in reports, its place in the rig
// file and how a Rig holds it. All in the units of the rig file.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/model/rig.h"

namespace backlash {

struct RigParameter {
  std::string name;  // in reports
  std::string unit;
  std::string key;  // in the rig file; empty: no scalar of its own there
  bool positive;    // > 0, else any
  double (*get)(const Rig&);
  void (*set)(Rig&, double);
};

/// Of two inertias with a mesh between them: motor_inertia load_inertia mesh_stiffness mesh_damping
/// backlash_angle motor_coulomb motor_viscous load_coulomb load_viscous, then where directions differ
/// motor_coulomb_asymmetry, motor_viscous_asymmetry, load_coulomb_asymmetry, load_viscous_asymmetry (half of
/// forward minus backward), and start_in_gap. Setting may make a rig that GearTrain refuses.
const std::vector<RigParameter>& servo_parameters();

/// By name; throws InvalidParameter.
const RigParameter& servo_parameter(const std::string& name);

}  // namespace backlash
