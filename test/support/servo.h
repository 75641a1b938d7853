// SPDX-License-Identifier: BSD-3-Clause
// The servo with two inertias, and records of it whose truth is known.
#pragma once

#include <string>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/simulation/simulation.h"
#include "support/data.h"

namespace backlash::test {

inline rig_file::RigFile servo_file() {
  return rig_file::load_rig_file(package_file("config/two_inertia_servo.yaml"));
}

/// A machine that differs from config/two_inertia_servo.yaml by up to 30 %.
inline model::Rig other_servo() {
  model::Rig rig = servo_file().rig;
  rig.motor.inertia = 7.8;
  rig.link.inertia = 84;
  rig.mesh.backlash = 6.3e-4;
  rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", 400e3}, {"damping", 560}});
  rig.motor.coulomb_friction = 47;
  rig.motor.viscous_damping = 10;
  rig.link.coulomb_friction = 18;
  rig.link.viscous_damping = 7;
  return rig;
}

/// The same with its load behind a shaft three times as stiff as the teeth, bearing and encoder before it, on
/// a gear of this share of the inertia.
inline model::Rig servo_behind_shaft(double gear) {
  model::Rig rig = other_servo();
  rig.output_coupling = {false, 1.2e6, 0, 0};
  rig.bearing_at_gear = true;
  rig.gear.inertia = gear * rig.link.inertia;
  rig.link.inertia -= rig.gear.inertia;
  return rig;
}

/// Torque that moves the servo to and fro with many impacts.
inline simulation::ExcitationSettings shaking(std::uint64_t seed) {
  simulation::ExcitationSettings e;
  e.type = "random";
  e.amplitude = 250;  // N m rms
  e.start_frequency = 0.2;
  e.end_frequency = 8;
  e.line_count = 60;
  e.seed = seed;
  return e;
}

inline simulation::SimulationSettings servo_run(std::uint64_t seed, bool noise = true) {
  simulation::SimulationSettings settings = servo_file().simulation;
  settings.excitation = shaking(seed);
  settings.sensors.seed = seed;
  if (!noise) settings.sensors.channels = {};
  return settings;
}

}  // namespace backlash::test
