// SPDX-License-Identifier: BSD-3-Clause
// Records of torque-sensor rigs that change while they run, by the simulation: code that the search for
// changes does not share.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/model/contact_law.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/simulation/simulation.h"

namespace backlash::test {

/// A change of a machine, and of what its sensors show.
struct RigEvent {
  std::string name;   // of the value that it moves, as detect_changes should name it
  double share = 0;   // of the value, but of motor_coulomb: of the drive's amplitude
  double span = 0;    // s, over which it grows; 0: at once
  bool named = true;  // whether one value of the machine is another
};

inline void scale_contact(model::Rig& rig, const char* value, double factor) {
  model::ContactSpec contact = rig.mesh.contact_spec();
  contact.values[value] *= factor;
  rig.mesh.contact = model::make_contact_law(contact.law, contact.values);
}

/// `part`: of the event, 0 before, 1 after. Gains, noise and offsets of sensors are put on the record.
inline void apply(const RigEvent& event, double part, rig_file::RigFile& file) {
  const double factor = 1 + part * event.share;
  model::Rig& rig = file.rig;
  if (event.name == "backlash") rig.mesh.backlash *= factor;
  if (event.name == "contact_stiffness") scale_contact(rig, "stiffness", factor);
  if (event.name == "sensor_stiffness") rig.input_coupling.stiffness *= factor;
  if (event.name == "output_stiffness") rig.output_coupling.stiffness *= factor;
  if (event.name == "motor_viscous") rig.motor.viscous_damping *= factor;
  if (event.name == "motor_coulomb")
    rig.motor.coulomb_friction += part * event.share * file.simulation.excitation.amplitude;
  if (event.name == "load_inertia") rig.link.inertia *= factor;
  if (event.name == "drive") file.simulation.excitation.amplitude *= factor;
  if (event.name == "noise") file.simulation.sensors.of(record::Channel::sensor_torque).noise *= factor;
}

inline void scale(record::Record& record, record::Channel channel, double factor) {
  for (double& x : record.column(channel)) x *= factor;
}

/// A run from a settled start, the same time after each begin of a period.
inline record::Record settled(const rig_file::RigFile& file, double duration) {
  constexpr double kSettling = 4;  // periods
  const double start = kSettling / file.simulation.excitation.frequency;
  record::Record r = simulation::simulate_record(file.rig, file.simulation, start + duration);
  const double half = 0.5 / file.simulation.sensors.sampling_rate;
  r = r.slice(start - half, start + duration - half);
  const double first = r.time.front();
  for (double& t : r.time) t -= first;  // less than a sample of the period is lost
  r.column(record::Channel::load_position).clear();
  return r;
}

/// What happens at `since` (a whole number of periods).
inline record::Record changing_record(const rig_file::RigFile& file, double duration, const RigEvent& event,
                                      double since) {
  record::Record all = settled(file, std::min(since, duration));
  constexpr double kStep = 2;  // s, of what grows
  const double whole = duration - since;
  const int steps = event.span > 0 ? static_cast<int>(whole / kStep) : 1;
  for (int i = 0; i < steps && whole > 0; ++i) {
    rig_file::RigFile changed = file;
    changed.simulation.sensors.seed += 1000 + static_cast<std::uint64_t>(i);
    const double step = event.span > 0 ? kStep : whole;
    apply(event, event.span > 0 ? (i + 0.5) * step / event.span : 1, changed);
    record::Record part = settled(changed, step);
    if (event.name == "sensor_gain") scale(part, record::Channel::sensor_torque, 1 + event.share);
    if (event.name == "motor_torque_gain") scale(part, record::Channel::motor_torque, 1 + event.share);
    if (event.name == "motor_position_gain") scale(part, record::Channel::motor_position, 1 + event.share);
    // Where a free link is, is of no run.
    const double moved = file.rig.link_locked ? 0
                                              : all.column(record::Channel::motor_position).back() -
                                                    part.column(record::Channel::motor_position).front();
    const double begin = all.time.back() + 1 / file.simulation.sensors.sampling_rate;
    for (const double t : part.time) all.time.push_back(begin + t);
    for (const record::Channel c : record::kChannels) {
      const double add = c == record::Channel::motor_position ? moved : 0;
      for (const double x : part.column(c)) all.column(c).push_back(x + add);
    }
  }
  all.name = "changing";
  return all;
}

/// The machine of a rig file, with all values off as far as one spread of the estimator and more.
inline rig_file::RigFile drawn_rig(rig_file::RigFile file, Random& random) {
  const auto times = [&](double factor) { return std::exp(random.uniform(-1, 1) * std::log(factor)); };
  model::Rig& rig = file.rig;
  rig.motor.inertia *= times(1.15), rig.pinion.inertia *= times(1.15), rig.gear.inertia *= times(1.15);
  rig.motor.viscous_damping *= times(1.5);
  rig.input_coupling.stiffness *= times(1.1), rig.input_coupling.damping *= times(2);
  if (!rig.output_coupling.rigid) rig.output_coupling.stiffness *= times(1.5);
  if (!rig.link_locked) rig.link.inertia *= times(1.15), rig.link.viscous_damping *= times(1.5);
  scale_contact(rig, "stiffness", times(1.5));
  rig.mesh.backlash = 2e-5 * std::exp(random.uniform() * std::log(7.5));  // 20 to 150 um
  auto& simulation = file.simulation;
  simulation.excitation.frequency = std::round(random.uniform(6, 12));
  simulation.excitation.amplitude *= random.uniform(0.8, 1.5);
  simulation.sensors.seed = random.bits();
  simulation.sensors.of(record::Channel::sensor_torque).noise =
      simulation.excitation.amplitude * 0.005 * std::exp(random.uniform() * std::log(6));
  simulation.sensors.of(record::Channel::motor_position).noise =
      1e-6 * std::exp(random.uniform() * std::log(10));
  return file;
}

}  // namespace backlash::test
