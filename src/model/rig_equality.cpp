// SPDX-License-Identifier: BSD-3-Clause
// Whether two rigs are the same machine. Each list of members below takes a whole struct apart: a member that
// is not in it does not compile.
#include <algorithm>
#include <tuple>

#include "backlash_diagnosis/model/rig.h"

namespace backlash::model {
namespace {

auto members(const Body& body) {
  const auto& [inertia, viscous, viscous_asymmetry, coulomb, coulomb_asymmetry] = body;
  return std::tie(inertia, viscous, viscous_asymmetry, coulomb, coulomb_asymmetry);
}

auto members(const Coupling& coupling) {
  const auto& [rigid, stiffness, damping, inertia] = coupling;
  return std::tie(rigid, stiffness, damping, inertia);
}

auto members(const ContactSpec& spec) {
  const auto& [law, values] = spec;
  return std::tie(law, values);
}

bool same_number(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

bool same_contact(const std::shared_ptr<const ContactLaw>& a, const std::shared_ptr<const ContactLaw>& b) {
  return a == b || (a && b && !a->made_of.law.empty() && members(a->made_of) == members(b->made_of));
}

bool same_term(const std::shared_ptr<const Term>& a, const std::shared_ptr<const Term>& b) {
  return a == b || (!a->id.empty() && a->id == b->id && a->values == b->values);
}

}  // namespace

bool operator==(const Body& a, const Body& b) {
  return members(a) == members(b);
}

bool operator==(const Coupling& a, const Coupling& b) {
  return members(a) == members(b);
}

bool operator==(const Mesh& a, const Mesh& b) {
  const auto& [rigid, backlash, base_radius, start, contact, variation, pairs] = a;
  return rigid == b.rigid && backlash == b.backlash && same_number(base_radius, b.base_radius) &&
         start == b.start_in_gap && same_contact(contact, b.contact) && variation == b.variation &&
         pairs == b.pairs;
}

bool operator==(const Rig& a, const Rig& b) {
  const auto& [name, joint, ratio, motor_side, linear, motor, pinion, gear, link, torque_constant, input,
               output, sensor_with_damper, at_gear, link_locked, mesh, terms, skew, coupled] = a;
  return name == b.name && joint == b.joint && ratio == b.reduction_ratio && motor_side == b.motor_side &&
         linear == b.linear && motor == b.motor && pinion == b.pinion && gear == b.gear && link == b.link &&
         same_number(torque_constant, b.torque_constant) && input == b.input_coupling &&
         output == b.output_coupling && sensor_with_damper == b.sensor_with_damper &&
         at_gear == b.bearing_at_gear && link_locked == b.link_locked && mesh == b.mesh &&
         skew == b.encoder_skew && coupled == b.coupled &&
         std::equal(terms.begin(), terms.end(), b.terms.begin(), b.terms.end(), same_term);
}

}  // namespace backlash::model
