// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/rig_parameters.h"

#include "backlash_diagnosis/base/error.h"

namespace backlash::rig_file {
namespace {

using Kind = ParameterKind;

void set_contact(model::Rig& rig, const char* name, double value) {
  model::ContactSpec changed = rig.mesh.contact_spec();
  changed.values[name] = value;
  rig.mesh.contact = model::make_contact_law(changed.law, changed.values);
}

double contact_value(const model::Rig& rig, const char* name) {
  const ParameterValues& values = rig.mesh.contact_spec().values;
  return values.has(name) ? values.at(name) : 0;  // no law has all of them
}

// How a model::Rig holds a number: as a member, or among the values of its contact law.
#define BACKLASH_FIELD(member) \
  [](const model::Rig& rig) { return rig.member; }, [](model::Rig& rig, double value) { rig.member = value; }
#define BACKLASH_CONTACT(name)                                    \
  [](const model::Rig& rig) { return contact_value(rig, name); }, \
      [](model::Rig& rig, double value) { set_contact(rig, name, value); }

/// Of one part, in this order: unlike a body's, the parameters of a mesh do not change with the reduction.
std::vector<RigParameter> inertias_and_mesh() {
  return {
      {"motor_inertia", RigPart::motor, Kind::inertia, "kg m^2", "gear_train.motor.inertia",
       Range::positive(), 2, "", "", "inertia", BACKLASH_FIELD(motor.inertia)},
      {"load_inertia", RigPart::link, Kind::inertia, "kg m^2", "gear_train.link.inertia", Range::positive(),
       0, "", "", "", BACKLASH_FIELD(link.inertia)},
      {"mesh_stiffness", RigPart::mesh, Kind::stiffness, "N m/rad", "gear_train.mesh.contact.stiffness",
       Range::positive(), 0, "stiffness", "", "", BACKLASH_CONTACT("stiffness")},
      {"mesh_series_stiffness", RigPart::mesh, Kind::series_stiffness, "N m/rad",
       "gear_train.mesh.contact.series_stiffness", Range::positive(), 0, "series_stiffness", "", "",
       BACKLASH_CONTACT("series_stiffness")},
      {"mesh_damping", RigPart::mesh, Kind::damping, "N m s/rad", "gear_train.mesh.contact.damping",
       Range::positive(), 0, "damping", "", "", BACKLASH_CONTACT("damping")},
      {"mesh_alpha", RigPart::mesh, Kind::damping_factor, "s/rad", "gear_train.mesh.contact.alpha",
       Range::positive(), 0, "alpha", "", "", BACKLASH_CONTACT("alpha")},
      {"backlash_angle", RigPart::mesh, Kind::backlash, "rad", "gear_train.mesh.backlash_angle",
       Range::positive(), 0, "", "", "",
       [](const model::Rig& rig) { return rig.mesh.backlash / rig.mesh.lever(); },
       [](model::Rig& rig, double value) { rig.mesh.backlash = value * rig.mesh.lever(); }},
  };
}

std::vector<RigParameter> friction() {
  return {
      {"motor_coulomb", RigPart::motor, Kind::coulomb_friction, "N m", "gear_train.motor.coulomb_friction",
       Range::positive(), 1, "", "", "coulomb", BACKLASH_FIELD(motor.coulomb_friction)},
      {"motor_viscous", RigPart::motor, Kind::viscous_friction, "N m s/rad",
       "gear_train.motor.viscous_damping", Range::positive(), 2, "", "", "viscous",
       BACKLASH_FIELD(motor.viscous_damping)},
      {"load_coulomb", RigPart::link, Kind::coulomb_friction, "N m", "gear_train.link.coulomb_friction",
       Range::positive(), 0, "", "", "", BACKLASH_FIELD(link.coulomb_friction)},
      {"load_viscous", RigPart::link, Kind::viscous_friction, "N m s/rad", "gear_train.link.viscous_damping",
       Range::positive(), 0, "", "", "", BACKLASH_FIELD(link.viscous_damping)},
      {"motor_coulomb_asymmetry", RigPart::motor, Kind::coulomb_friction, "N m", "", Range::any(), 1, "",
       "motor_coulomb", "offset", BACKLASH_FIELD(motor.coulomb_asymmetry)},
      {"motor_viscous_asymmetry", RigPart::motor, Kind::viscous_friction, "N m s/rad", "", Range::any(), 2,
       "", "motor_viscous", "", BACKLASH_FIELD(motor.viscous_asymmetry)},
      {"load_coulomb_asymmetry", RigPart::link, Kind::coulomb_friction, "N m", "", Range::any(), 0, "",
       "load_coulomb", "", BACKLASH_FIELD(link.coulomb_asymmetry)},
      {"load_viscous_asymmetry", RigPart::link, Kind::viscous_friction, "N m s/rad", "", Range::any(), 0, "",
       "load_viscous", "", BACKLASH_FIELD(link.viscous_asymmetry)},
  };
}

std::vector<RigParameter> make_parameters() {
  std::vector<RigParameter> all = inertias_and_mesh();
  for (RigParameter& p : friction()) all.push_back(std::move(p));
  all.push_back({"start_in_gap", RigPart::mesh, Kind::start_in_gap, "-", "gear_train.mesh.start_in_gap",
                 Range::any(), 0, "", "", "", BACKLASH_FIELD(mesh.start_in_gap)});
  all.push_back({"output_stiffness", RigPart::output, Kind::stiffness, "N m/rad",
                 "gear_train.output_coupling.stiffness", Range::positive(), 0, "", "", "",
                 BACKLASH_FIELD(output_coupling.stiffness)});
  all.push_back({"encoder_skew", RigPart::sensors, Kind::encoder_skew, "s", "sensors.encoder_skew",
                 Range::any(), 0, "", "", "", BACKLASH_FIELD(encoder_skew)});
  return all;
}

#undef BACKLASH_FIELD
#undef BACKLASH_CONTACT

}  // namespace

bool RigParameter::known_to(const model::Rig& rig) const {
  if (part == RigPart::sensors) return !rig.mesh.rigid && !rig.link_locked;
  if (part == RigPart::output) return !rig.output_coupling.rigid;
  if (part != RigPart::mesh) return true;
  return !rig.mesh.rigid && (contact.empty() || rig.mesh.contact_spec().values.has(contact));
}

const std::vector<RigParameter>& servo_parameters() {
  static const std::vector<RigParameter> parameters = make_parameters();
  return parameters;
}

const RigParameter& servo_parameter(const std::string& name) {
  for (const RigParameter& parameter : servo_parameters())
    if (parameter.name == name) return parameter;
  throw InvalidParameter("parameter", name, "is not one of a servo with two inertias");
}

const RigParameter& servo_parameter(RigPart part, ParameterKind kind) {
  for (const RigParameter& parameter : servo_parameters())
    if (parameter.part == part && parameter.kind == kind && !parameter.is_asymmetry()) return parameter;
  throw InvalidParameter("parameter", "of this part and kind", "is not one of a servo with two inertias");
}

bool shown_by_deflection(const RigParameter& p) {
  const bool dry = p.part == RigPart::motor && p.kind == Kind::coulomb_friction && !p.is_asymmetry();
  return p.kind == Kind::encoder_skew || p.kind == Kind::stiffness || dry;
}

const RigParameter* asymmetry_of(const RigParameter& mean) {
  for (const RigParameter& parameter : servo_parameters())
    if (parameter.mean == mean.name) return &parameter;
  return nullptr;
}

}  // namespace backlash::rig_file
