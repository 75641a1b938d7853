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
  std::function<void(model::Rig&)> apply;
};

inline std::vector<RigChange> rig_changes() {
  std::vector<RigChange> changes = {
      {"name", [](model::Rig& r) { r.name += "x"; }},
      {"joint", [](model::Rig& r) { r.joint += "x"; }},
      {"reduction_ratio", [](model::Rig& r) { r.reduction_ratio *= 2; }},
      {"motor_side", [](model::Rig& r) { r.motor_side = !r.motor_side; }},
      {"linear", [](model::Rig& r) { r.linear = !r.linear; }},
      {"torque_constant", [](model::Rig& r) { r.torque_constant = 0.7; }},
      {"sensor_with_damper", [](model::Rig& r) { r.sensor_with_damper = !r.sensor_with_damper; }},
      {"coupled", [](model::Rig& r) { r.coupled = !r.coupled; }},
      {"encoder_skew", [](model::Rig& r) { r.encoder_skew += 1e-3; }},
      {"link_locked", [](model::Rig& r) { r.link_locked = !r.link_locked; }},
      {"mesh.rigid", [](model::Rig& r) { r.mesh.rigid = !r.mesh.rigid; }},
      {"mesh.backlash", [](model::Rig& r) { r.mesh.backlash *= 1.1; }},
      {"mesh.base_radius", [](model::Rig& r) { r.mesh.base_radius = 1.3; }},
      {"mesh.start_in_gap", [](model::Rig& r) { r.mesh.start_in_gap += 0.5; }},
      {"mesh.contact",
       [](model::Rig& r) {
         model::ContactSpec softer = r.mesh.contact_spec();
         softer.values["stiffness"] *= 0.9;
         r.mesh.contact = model::make_contact_law(softer.law, softer.values);
       }},
      {"mesh.variation",
       [](model::Rig& r) {
         r.mesh.variation = std::make_shared<model::StiffnessVariation>(
             model::MeshStiffness(sarkar_gears(), {"step", 1, 206e9, 0.3, 0.1}), 0);
       }},
      {"mesh.pairs",
       [](model::Rig& r) {
         r.mesh.pairs = std::make_shared<model::ToothPairs>(
             model::MeshCycle{model::MeshStiffness(sarkar_gears(), {"step", 1, 206e9, 0.3, 0.1}), 0},
             model::ToothErrors{});
       }},
      {"terms of the motor",
       [](model::Rig& r) {
         r.terms.push_back(model::make_term("cogging", {{"amplitude", 5}, {"order", 40}, {"phase", 0}}));
       }},
      {"terms of the load",
       [](model::Rig& r) {
         r.terms.push_back(model::make_term("gravity", {{"amplitude", 30}, {"phase", 1}}));
       }},
  };
  const std::pair<std::string, model::Body model::Rig::*> bodies[] = {{"motor", &model::Rig::motor},
                                                                      {"pinion", &model::Rig::pinion},
                                                                      {"gear", &model::Rig::gear},
                                                                      {"link", &model::Rig::link}};
  for (const auto& [name, body] : bodies) {
    const std::pair<std::string, double model::Body::*> members[] = {
        {"inertia", &model::Body::inertia},
        {"viscous_damping", &model::Body::viscous_damping},
        {"viscous_asymmetry", &model::Body::viscous_asymmetry},
        {"coulomb_friction", &model::Body::coulomb_friction},
        {"coulomb_asymmetry", &model::Body::coulomb_asymmetry}};
    for (const auto& [member, number] : members)
      changes.push_back(
          {name + "." + member, [body = body, number = number](model::Rig& r) { r.*body.*number += 2; }});
  }
  const std::pair<std::string, model::Coupling model::Rig::*> couplings[] = {
      {"input_coupling", &model::Rig::input_coupling}, {"output_coupling", &model::Rig::output_coupling}};
  for (const auto& [name, coupling] : couplings) {
    changes.push_back({name + ".rigid", [c = coupling](model::Rig& r) { (r.*c).rigid = !(r.*c).rigid; }});
    const std::pair<std::string, double model::Coupling::*> members[] = {
        {"stiffness", &model::Coupling::stiffness},
        {"damping", &model::Coupling::damping},
        {"inertia", &model::Coupling::inertia}};
    for (const auto& [member, number] : members)
      changes.push_back(
          {name + "." + member, [c = coupling, number = number](model::Rig& r) { r.*c.*number += 5; }});
  }
  return changes;
}

}  // namespace backlash::test
