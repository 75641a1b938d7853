// SPDX-License-Identifier: BSD-3-Clause
// A rig with one member changed, for each member of it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/rig.h"
#include "support/gears.h"

namespace backlash::test {

struct RigChange {
  std::string member;
  std::function<void(Rig&)> apply;
};

inline std::vector<RigChange> rig_changes() {
  std::vector<RigChange> changes = {
      {"name", [](Rig& r) { r.name += "x"; }},
      {"joint", [](Rig& r) { r.joint += "x"; }},
      {"reduction_ratio", [](Rig& r) { r.reduction_ratio *= 2; }},
      {"motor_side", [](Rig& r) { r.motor_side = !r.motor_side; }},
      {"linear", [](Rig& r) { r.linear = !r.linear; }},
      {"torque_constant", [](Rig& r) { r.torque_constant = 0.7; }},
      {"sensor_with_damper", [](Rig& r) { r.sensor_with_damper = !r.sensor_with_damper; }},
      {"link_locked", [](Rig& r) { r.link_locked = !r.link_locked; }},
      {"mesh.rigid", [](Rig& r) { r.mesh.rigid = !r.mesh.rigid; }},
      {"mesh.backlash", [](Rig& r) { r.mesh.backlash *= 1.1; }},
      {"mesh.base_radius", [](Rig& r) { r.mesh.base_radius = 1.3; }},
      {"mesh.start_in_gap", [](Rig& r) { r.mesh.start_in_gap += 0.5; }},
      {"mesh.contact_spec", [](Rig& r) { r.mesh.contact_spec.values["stiffness"] *= 1.1; }},
      {"mesh.contact",
       [](Rig& r) {
         ContactSpec softer = r.mesh.contact->made_of;
         softer.values["stiffness"] *= 0.9;
         r.mesh.contact = make_contact_law(softer.law, softer.values);
       }},
      {"mesh.variation",
       [](Rig& r) {
         r.mesh.variation = std::make_shared<StiffnessVariation>(
             MeshStiffness(sarkar_gears(), {"step", 1, 206e9, 0.3, 0.1}), 0);
       }},
      {"terms of the motor",
       [](Rig& r) {
         r.terms.push_back(make_term("cogging", {{"amplitude", 5}, {"order", 40}, {"phase", 0}}));
       }},
      {"terms of the load",
       [](Rig& r) {
         r.terms.push_back(make_term("gravity", {{"amplitude", 30}, {"phase", 1}}));
       }},
  };
  const std::pair<std::string, Body Rig::*> bodies[] = {
      {"motor", &Rig::motor}, {"pinion", &Rig::pinion}, {"gear", &Rig::gear}, {"link", &Rig::link}};
  for (const auto& [name, body] : bodies) {
    const std::pair<std::string, double Body::*> members[] = {
        {"inertia", &Body::inertia},
        {"viscous_damping", &Body::viscous_damping},
        {"viscous_asymmetry", &Body::viscous_asymmetry},
        {"coulomb_friction", &Body::coulomb_friction},
        {"coulomb_asymmetry", &Body::coulomb_asymmetry}};
    for (const auto& [member, number] : members)
      changes.push_back(
          {name + "." + member, [body = body, number = number](Rig& r) { r.*body.*number += 2; }});
  }
  const std::pair<std::string, Coupling Rig::*> couplings[] = {{"input_coupling", &Rig::input_coupling},
                                                               {"output_coupling", &Rig::output_coupling}};
  for (const auto& [name, coupling] : couplings) {
    changes.push_back({name + ".rigid", [c = coupling](Rig& r) { (r.*c).rigid = !(r.*c).rigid; }});
    const std::pair<std::string, double Coupling::*> members[] = {{"stiffness", &Coupling::stiffness},
                                                                  {"damping", &Coupling::damping},
                                                                  {"inertia", &Coupling::inertia}};
    for (const auto& [member, number] : members)
      changes.push_back(
          {name + "." + member, [c = coupling, number = number](Rig& r) { r.*c.*number += 5; }});
  }
  return changes;
}

}  // namespace backlash::test
