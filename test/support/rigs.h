// SPDX-License-Identifier: BSD-3-Clause
// Rigs, excitations and tolerances that several tests share.
#pragma once

#include <string>

#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/data.h"

namespace backlash::test {

/// config/sarkar_1997.yaml with another half gap [m].
inline model::Rig sarkar_rig(double half_gap) {
  model::Rig rig = model::read_rig(YamlReader::from_file(package_file("config/sarkar_1997.yaml")));
  rig.mesh.backlash = 2 * half_gap;
  return rig;
}

/// A mass [kg] on the line of action between two walls, `half_gap` [m] from the middle: one degree of
/// freedom.
inline model::Rig wall_rig(double mass, double half_gap, std::shared_ptr<const model::ContactLaw> law) {
  model::Rig rig;
  rig.mesh.base_radius = 0.02;
  rig.motor.inertia = mass * 0.02 * 0.02;
  rig.link_locked = true;
  rig.mesh.backlash = 2 * half_gap;
  rig.mesh.contact = std::move(law);
  return rig;
}

/// Two masses [kg] free to move along the line of action, `half_gap` [m] apart either way.
inline model::Rig two_body_rig(double first, double second, double half_gap,
                               std::shared_ptr<const model::ContactLaw> law) {
  model::Rig rig = wall_rig(first, half_gap, std::move(law));
  rig.link_locked = false;
  rig.link.inertia = second * 0.02 * 0.02;
  return rig;
}

inline simulation::ExcitationSettings square(double amplitude, double frequency) {
  simulation::ExcitationSettings settings;
  settings.type = "square";
  settings.amplitude = amplitude;
  settings.frequency = frequency;
  return settings;
}

inline simulation::ExcitationSettings constant(double torque) {
  simulation::ExcitationSettings settings;
  settings.type = "constant";
  settings.amplitude = torque;
  return settings;
}

inline simulation::ExcitationSettings topic() {
  simulation::ExcitationSettings settings;
  settings.type = "topic";
  return settings;
}

/// Absolute tolerances fall with the relative one, from those of the shipped rigs at 1e-6.
inline simulation::SolverSettings solver(double relative_tolerance,
                                         const std::string& method = "dormand_prince") {
  return {method, relative_tolerance, 1e-4 * relative_tolerance, 0.1 * relative_tolerance};
}

}  // namespace backlash::test
