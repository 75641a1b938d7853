// SPDX-License-Identifier: BSD-3-Clause
#include "joint_model.h"

#include <fmt/format.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/model/contact_law.h"

namespace backlash::report {
namespace {

constexpr double kStep = 1e-4;  // relative, of the differences that give a tangent

JointBody lumped(const model::Body& a, const model::Body& b, double more) {
  return {a.inertia + b.inertia + more, a.viscous_damping + b.viscous_damping,
          a.coulomb_friction + b.coulomb_friction};
}

/// The tangent of the contact law at a torque, in N m over rad.
void linearise(const model::Rig& rig, const std::string& source, std::optional<double> torque,
               JointModel& joint) {
  const model::ContactSpec& spec = rig.mesh.contact_spec();
  const double lever = rig.mesh.lever(), square = lever * lever;
  if (spec.law == "linear" || spec.law == "kelvin_voigt") {
    joint.stiffness = spec.values.at("stiffness") * square;
    joint.damping = spec.values.at("damping") * square;
    if (spec.law == "kelvin_voigt" && joint.damping > 0)
      joint.unsaid.emplace_back("contact law kelvin_voigt: here the teeth never pull, as in `linear`");
    return;
  }
  if (!torque)
    throw BadData(source, "contact law " + spec.law +
                              " is no spring and damper: say at which torque it shall be one (--torque)");
  const model::ContactLaw& law = *rig.mesh.contact;
  const double force = *torque / lever;
  const double rest = law.static_penetration(force);
  if (!(rest > 0) || !std::isfinite(rest))
    throw BadData(source, "contact law " + spec.law + ": the teeth do not yield, no stiffness can be given");
  const double more = law.static_penetration(force * (1 + kStep)),
               less = law.static_penetration(force * (1 - kStep));
  joint.stiffness = 2 * kStep * force / (more - less) * square;
  const std::string at = fmt::format(" at {:.4g} {}", *torque, rig.linear ? "N" : "N m");
  if (law.needs_impact_speed()) {
    joint.unsaid.push_back("contact law " + spec.law + ": its stiffness is that" + at +
                           "; its loss, which depends on the speed of the impact, is left out");
    return;
  }
  const double rate = kStep * rest;  // m/s; a law is smooth in the rate where the teeth are pressed together
  joint.damping = (law.force(rest, rate, 0) - law.force(rest, -rate, 0)) / (2 * rate) * square;
  joint.unsaid.push_back("contact law " + spec.law + ": stiffness and damping are its tangent" + at);
}

void take_terms(const model::Rig& rig, JointModel& joint) {
  for (const auto& term : rig.terms) {
    if (term->id == "gravity" && !rig.linear && !joint.gravity) {
      joint.gravity = JointGravity{term->values.at("amplitude"), term->values.at("phase")};
      if (joint.gravity->amplitude == 0) joint.gravity.reset();
      continue;
    }
    joint.unsaid.push_back("term " + term->id);
  }
}

void note_asymmetry(const model::Body& body, const char* name, JointModel& joint) {
  if (body.viscous_asymmetry == 0 && body.coulomb_asymmetry == 0) return;
  joint.unsaid.push_back(fmt::format(
      "{}: friction that differs between the directions by {:.6g} {} and {:.6g} {}, here its mean", name,
      2 * body.coulomb_asymmetry, model::axis_unit("N m", joint.linear), 2 * body.viscous_asymmetry,
      model::axis_unit("N m s/rad", joint.linear)));
}

void take_mesh(const model::Rig& rig, const std::string& source, std::optional<double> torque,
               JointModel& joint) {
  const double half = 0.5 * rig.mesh.backlash / rig.mesh.lever();
  joint.forward = half * (1 - rig.mesh.start_in_gap);
  joint.backward = -half * (1 + rig.mesh.start_in_gap);
  linearise(rig, source, torque, joint);
  if (rig.mesh.variation) joint.unsaid.emplace_back("stiffness along the mesh cycle, here its mean");
  if (rig.mesh.pairs) joint.unsaid.emplace_back("pairs of teeth that come and go, here one mesh");
}

}  // namespace

JointModel joint_model(const rig_file::RigFile& file, std::optional<double> torque) {
  const bool one = file.rig.mesh.rigid;
  if (torque && (!std::isfinite(*torque) || *torque <= 0))
    throw InvalidParameter("torque", *torque, "must be > 0 N m");
  if (file.rig.link_locked) throw BadData(file.source, "gear_train.link is locked: no joint is left");
  if (!file.rig.input_coupling.rigid || !file.rig.output_coupling.rigid)
    throw BadData(file.source,
                  "has flexible couplings: only one inertia, or two with a gap, can be exported");
  const model::Rig rig = model::load_side(file.rig);
  JointModel joint;
  joint.name = rig.joint;
  joint.linear = rig.linear;
  joint.ratio = file.rig.reduction_ratio;
  joint.torque_gear = file.rig.motor_axis_ratio();
  joint.motor = lumped(rig.motor, rig.pinion, rig.input_coupling.inertia);
  const JointBody load = lumped(rig.gear, rig.link, rig.output_coupling.inertia);
  if (one) {
    joint.motor = {joint.motor.inertia + load.inertia, joint.motor.viscous + load.viscous,
                   joint.motor.coulomb + load.coulomb};
  } else {
    joint.load = load;
    take_mesh(rig, file.source, torque, joint);
  }
  for (const auto& [body, name] : {std::pair{&rig.motor, "motor"}, std::pair{&rig.link, "link"}})
    note_asymmetry(*body, name, joint);
  take_terms(rig, joint);
  if (rig.coupled) joint.unsaid.emplace_back("other axes move as well, and their coupling is in the torque");
  if (rig.encoder_skew != 0)
    joint.unsaid.push_back("encoder_skew of " + to_text(rig.encoder_skew) + " s: no sensors are exported");
  return joint;
}

}  // namespace backlash::report
