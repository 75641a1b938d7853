// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/rig_parameters.h"

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

void set_contact(Rig& rig, const char* name, double value) {
  Mesh& mesh = rig.mesh;
  mesh.contact_spec.values[name] = value;
  mesh.contact = make_contact_law(mesh.contact_spec.law, mesh.contact_spec.values);
}

double contact_value(const Rig& rig, const char* name) {
  const ParameterValues& values = rig.mesh.contact_spec.values;
  return values.has(name) ? values.at(name) : 0;  // no law has all of them
}

// One line per number of a Rig.
#define BACKLASH_FIELD(member) \
  [](const Rig& rig) { return rig.member; }, [](Rig& rig, double value) { rig.member = value; }

std::vector<RigParameter> make_parameters() {
  return {
      {"motor_inertia", "kg m^2", "gear_train.motor.inertia", true, BACKLASH_FIELD(motor.inertia)},
      {"load_inertia", "kg m^2", "gear_train.link.inertia", true, BACKLASH_FIELD(link.inertia)},
      {"mesh_stiffness", "N m/rad", "gear_train.mesh.contact.stiffness", true,
       [](const Rig& rig) { return contact_value(rig, "stiffness"); },
       [](Rig& rig, double value) { set_contact(rig, "stiffness", value); }},
      {"mesh_damping", "N m s/rad", "gear_train.mesh.contact.damping", true,
       [](const Rig& rig) { return contact_value(rig, "damping"); },
       [](Rig& rig, double value) { set_contact(rig, "damping", value); }},
      {"mesh_alpha", "s/rad", "gear_train.mesh.contact.alpha", true,
       [](const Rig& rig) { return contact_value(rig, "alpha"); },
       [](Rig& rig, double value) { set_contact(rig, "alpha", value); }},
      {"backlash_angle", "rad", "gear_train.mesh.backlash_angle", true,
       [](const Rig& rig) { return rig.mesh.backlash / rig.mesh.lever(); },
       [](Rig& rig, double value) { rig.mesh.backlash = value * rig.mesh.lever(); }},
      {"motor_coulomb", "N m", "gear_train.motor.coulomb_friction", true,
       BACKLASH_FIELD(motor.coulomb_friction)},
      {"motor_viscous", "N m s/rad", "gear_train.motor.viscous_damping", true,
       BACKLASH_FIELD(motor.viscous_damping)},
      {"load_coulomb", "N m", "gear_train.link.coulomb_friction", true,
       BACKLASH_FIELD(link.coulomb_friction)},
      {"load_viscous", "N m s/rad", "gear_train.link.viscous_damping", true,
       BACKLASH_FIELD(link.viscous_damping)},
      {"motor_coulomb_asymmetry", "N m", "", false, BACKLASH_FIELD(motor.coulomb_asymmetry)},
      {"motor_viscous_asymmetry", "N m s/rad", "", false, BACKLASH_FIELD(motor.viscous_asymmetry)},
      {"load_coulomb_asymmetry", "N m", "", false, BACKLASH_FIELD(link.coulomb_asymmetry)},
      {"load_viscous_asymmetry", "N m s/rad", "", false, BACKLASH_FIELD(link.viscous_asymmetry)},
      {"start_in_gap", "-", "gear_train.mesh.start_in_gap", false, BACKLASH_FIELD(mesh.start_in_gap)},
  };
}

#undef BACKLASH_FIELD

}  // namespace

const std::vector<RigParameter>& servo_parameters() {
  static const std::vector<RigParameter> parameters = make_parameters();
  return parameters;
}

const RigParameter& servo_parameter(const std::string& name) {
  for (const RigParameter& parameter : servo_parameters())
    if (parameter.name == name) return parameter;
  throw InvalidParameter("parameter", name, "is not one of a servo with two inertias");
}

}  // namespace backlash
