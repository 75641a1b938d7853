// SPDX-License-Identifier: BSD-3-Clause
// The table of the parameters of a rig that can be fitted to a record: what each is, its name in reports, its
// place in the rig file and how a Rig holds it. Who needs to know what a parameter is asks the table, not the
// name.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/model/rig.h"

namespace backlash::rig_file {

/// What a parameter belongs to.
enum class RigPart { motor, link, mesh, output, sensors };

enum class ParameterKind {
  inertia,
  stiffness,
  damping,
  series_stiffness,  // of what yields behind the contact of the teeth
  damping_factor,    // of a contact law whose damping grows with the force: alpha of Hunt and Crossley (1975)
  backlash,
  start_in_gap,  // where in the gap both positions are 0
  coulomb_friction,
  viscous_friction,
  encoder_skew,  // by how much load_position is later than motor_position
};

struct RigParameter {
  std::string name;  // in reports
  RigPart part;
  ParameterKind kind;
  std::string unit;     // at the load side; of a rotary rig, see axis_unit()
  std::string key;      // in the rig file; empty: no scalar of its own there
  Range range;          // of a fitted value
  int ratio_power;      // load-side value = value in the file * motor_axis_ratio()^ratio_power
  std::string contact;  // the parameter of the contact law that it is; empty: none
  std::string mean;     // of half a difference between directions: the name of their mean; empty: it is none
  std::string one_inertia;  // its name in reports on a machine of one inertia; empty: such a machine has none
  double (*get)(const model::Rig&);
  void (*set)(model::Rig&, double);

  bool positive() const { return range.lower == 0 && range.open_lower; }
  bool is_friction() const {
    return kind == ParameterKind::coulomb_friction || kind == ParameterKind::viscous_friction;
  }
  /// Half of forward minus backward.
  bool is_asymmetry() const { return !mean.empty(); }
  /// Whether a machine like this rig has such a parameter: a rigid mesh has none, a contact law only its own;
  /// encoders are compared where the load moves freely behind the mesh.
  bool known_to(const model::Rig& rig) const;
};

/// Of two inertias with a mesh between them: motor_inertia load_inertia mesh_stiffness mesh_damping
/// mesh_series_stiffness mesh_alpha backlash_angle motor_coulomb motor_viscous load_coulomb load_viscous,
/// then where directions differ motor_coulomb_asymmetry, motor_viscous_asymmetry, load_coulomb_asymmetry,
/// load_viscous_asymmetry, start_in_gap, output_stiffness of a flexible output coupling, and encoder_skew.
/// Setting may make a rig that GearTrain refuses.
const std::vector<RigParameter>& servo_parameters();

/// By name, or by what it is (of both directions: the mean). Throw InvalidParameter for one that is not in
/// the table.
const RigParameter& servo_parameter(const std::string& name);
const RigParameter& servo_parameter(RigPart part, ParameterKind kind);

/// Whether this parameter can be identified from the deflection of a machine whose torque holds the coupling
/// of other axes (Rig::coupled): skew, stiffness, and dry friction of the motor. Viscous friction acts like a
/// skew.
bool shown_by_deflection(const RigParameter& parameter);

/// The parameter that says how far the directions of this one differ; null: it has none.
const RigParameter* asymmetry_of(const RigParameter& mean);

}  // namespace backlash::rig_file
