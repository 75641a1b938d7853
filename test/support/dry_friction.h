// SPDX-License-Identifier: BSD-3-Clause
// Machines with dry friction, and what moves them.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include "backlash_diagnosis/simulation/plant.h"

namespace backlash::simulation::dry_friction {

inline std::shared_ptr<const model::ContactLaw> linear(double stiffness, double damping) {
  return model::make_contact_law("linear", {{"stiffness", stiffness}, {"damping", damping}});
}

/// One body that never meets a wall.
inline model::Rig block(const model::Body& body) {
  model::Rig rig;
  rig.motor = body;
  rig.link_locked = true;
  rig.mesh.backlash = 1e6;
  rig.mesh.contact = linear(1, 0);
  return rig;
}

/// Configuration 2 of Yumrukcal (2013), rounded, with friction that differs between the directions.
inline model::Rig servo() {
  model::Rig rig;
  rig.motor = {6.3, 13, 1, 63, 4};
  rig.link = {108, 9, -2, 15, -3};
  rig.mesh.backlash = 5.4e-4;
  rig.mesh.contact = linear(460e3, 483);
  return rig;
}

inline ExcitationSettings sine(double amplitude, double frequency, double phase = 0) {
  ExcitationSettings settings;
  settings.type = "multi_sine";
  settings.lines = {{amplitude, frequency, phase}};
  return settings;
}

inline ExcitationSettings at_load(ExcitationSettings settings) {
  settings.at_load = true;
  return settings;
}

inline ExcitationSettings braked(ExcitationSettings settings) {
  settings.motor_brake = true;
  return settings;
}

/// Angles, then speeds.
inline void put(Plant& plant, const std::vector<double>& values) {
  Plant::State state{};
  std::copy(values.begin(), values.end(), state.begin());
  plant.set_state(state);
}

inline double root(const std::function<double(double)>& f, double low, double high) {
  const bool rises = f(high) > 0;
  for (int i = 0; i < 200; ++i) ((f(0.5 * (low + high)) > 0) == rises ? high : low) = 0.5 * (low + high);
  return 0.5 * (low + high);
}

}  // namespace backlash::simulation::dry_friction
