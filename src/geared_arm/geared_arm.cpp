// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/geared_arm.h"

#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/geared_arm/drive_effects.h"

namespace backlash::geared_arm {
namespace {

Gear read_gear(const YamlReader& yaml) {
  Gear gear;
  gear.backlash = yaml.number("backlash_angle", Range::not_negative());
  const YamlReader contact = yaml.map("contact");
  const model::ContactSpec spec = model::read_contact_spec(contact);
  gear.contact = model::make_contact_law(spec.law, spec.values);
  // Such a law needs the moment of each touch, which this plant does not look for.
  if (gear.contact->needs_impact_speed())
    contact.fail("law", "needs the speed of a touch, which an arm does not have");
  yaml.finish();
  return gear;
}

diagnosis::Limits read_joint_limits(const YamlReader& yaml) {
  const diagnosis::Limits limits = diagnosis::read_limits(yaml);
  if (!limits.angular) yaml.fail("backlash", "the play of an arm's joint is an angle: backlash_angle");
  return limits;
}

GearedJoint read_joint(const YamlReader& yaml, const arm::JointDrive& drive, bool simulated) {
  GearedJoint joint;
  if (const auto gear = yaml.optional_map("gear")) joint.gear = read_gear(*gear);
  if (const auto limits = yaml.optional_map("limits")) joint.limits = read_joint_limits(*limits);
  joint.link_coulomb = yaml.number_or("link_coulomb", 0, Range::not_negative());
  joint.link_viscous = yaml.number_or("link_viscous", 0, Range::not_negative());
  if (yaml.has("held")) joint.held = yaml.number("held", Range::any());
  if (!simulated) return joint;
  const auto term = [&](arm::DriveTerm t) { return drive.terms[std::size_t(t)]; };
  const bool geared = joint.gear && !joint.held;
  const std::string no_mesh =
      "follows the torque of the teeth: a joint that is simulated needs a `gear` for it";
  if (term(arm::DriveTerm::load) != 0 && !geared) yaml.fail("load", no_mesh);
  if (!(DriveEffects::recorded_more(drive.effects) > -1))
    yaml.fail("effects", "gains that together leave the motor no torque");
  for (const arm::JointEffect& effect : drive.effects) {
    const arm::JointEffectSpec& spec = effect.spec();
    if (spec.drive_term == std::string("load") && !geared) yaml.fail("effects", effect.id + " " + no_mesh);
  }
  if (joint.held) {
    yaml.ignore("excitation");
    return joint;
  }
  if (joint.gear && !(term(arm::DriveTerm::rotor_inertia) > 0))
    yaml.fail("name", "a joint with a gear needs rotor_inertia > 0: the motor's side of its gap");
  joint.excitation = simulation::read_excitation(yaml.map("excitation"));
  if (joint.excitation.at_load || joint.excitation.motor_brake)
    yaml.fail("excitation", "an arm's excitation acts on the motor");
  return joint;
}

GearedArm geared_arm_of(arm::ArmRig rig) {
  GearedArm arm;
  arm.rig = std::move(rig);
  const YamlReader yaml = YamlReader::from_text(arm.rig.text, arm.rig.source);
  const auto simulated = yaml.optional_map("simulation");
  arm.simulated = simulated.has_value();
  if (simulated) {
    arm.gravity_compensation = simulated->boolean("gravity_compensation");
    arm.sensors = simulation::read_sensors(simulated->map("sensors"));
    if (const auto solver = simulated->optional_map("solver")) arm.solver = simulation::read_solver(*solver);
    simulated->finish();
  }
  const std::vector<YamlReader> joints = yaml.maps("joints");
  for (std::size_t j = 0; j < joints.size(); ++j)
    arm.joints.push_back(read_joint(joints[j], arm.rig.joints[j], arm.simulated));
  return arm;
}

}  // namespace

GearedArm load_geared_arm(const std::string& path) {
  return geared_arm_of(arm::load_arm_rig(path));
}

GearedArm geared_arm_from_text(const std::string& text, const std::string& source,
                               const std::string& folder) {
  return geared_arm_of(arm::arm_rig_from_text(text, source, folder));
}

}  // namespace backlash::geared_arm
