// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/simulation.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::simulation {
namespace {

/// `machine` as it would be seen beside the torque of `drive`.
model::Observation driven(model::Observation machine, const model::Observation& drive) {
  machine.motor_torque = drive.motor_torque;
  machine.motor_current = drive.motor_current;
  return machine;
}

}  // namespace

SimulationSettings read_simulation_settings(const YamlReader& yaml) {
  SimulationSettings settings;
  settings.excitation = read_excitation(yaml.map("excitation"));
  settings.sensors = read_sensors(yaml.map("sensors"));
  if (const auto solver = yaml.optional_map("solver")) settings.solver = read_solver(*solver);
  return settings;
}

Simulation::Simulation(const model::Rig& rig, const SimulationSettings& settings)
    : plant_(rig, settings.excitation, settings.solver),
      sensors_(settings.sensors),
      rate_(settings.sensors.sampling_rate),
      delay_(model::sensing(rig.terms).torque_delay),
      late_samples_(static_cast<long>(std::ceil(std::fabs(delay_) * rate_))),
      after_sample_(std::max(0.0, double(late_samples_) / rate_ - std::fabs(delay_))) {
  forget();
}

void Simulation::forget() {
  past_.assign(late_samples_, plant_.gear_train().observe(plant_.state().data(), model::AppliedTorque()));
}

/// Moves on to the next sample, by way of the moment that a later one shows.
model::Observation Simulation::observe() {
  if (late_samples_ > 0 && index_ > 0) {
    plant_.advance_to(double(index_ - 1) / rate_ + after_sample_);
    past_.push_back(plant_.observe());
  }
  plant_.advance_to(double(index_) / rate_);
  const model::Observation now = plant_.observe();
  if (late_samples_ == 0) return now;
  const model::Observation before = past_.front();
  past_.pop_front();
  return delay_ > 0 ? driven(before, now) : driven(now, before);
}

model::Observation Simulation::step() {
  const model::Observation exact = observe();
  ++index_;
  return sensors_.measure(exact);
}

void Simulation::reset() {
  plant_.reset();
  sensors_.reset();
  index_ = 0;
  forget();
}

record::Record simulate_record(const model::Rig& rig, const SimulationSettings& settings, double duration,
                               const Progress& progress) {
  if (!(duration > 0) || !std::isfinite(duration))
    throw InvalidParameter("duration", duration, "must be > 0 s");
  Simulation simulation(rig, settings);
  const long samples = std::lround(duration * simulation.sampling_rate());
  if (samples < 1 || samples > 1'000'000'000L)
    throw InvalidParameter("duration", duration, "gives no sample or more than 1e9 at this sampling rate");
  record::Record record;
  record.name = rig.name;
  record.time.reserve(samples);
  for (long k = 0; k < samples; ++k) {
    if (progress && k % 1024 == 0 && !progress(double(k) / double(samples), "simulating")) throw Cancelled();
    record.time.push_back(double(k) / simulation.sampling_rate());
    const model::Observation o = simulation.step();
    record.column(record::Channel::motor_torque).push_back(o.motor_torque);
    record.column(record::Channel::motor_position).push_back(o.motor_position);
    record.column(record::Channel::motor_velocity).push_back(o.motor_velocity);
    record.column(record::Channel::load_position).push_back(o.load_position);
    record.column(record::Channel::load_velocity).push_back(o.load_velocity);
    if (!std::isnan(o.sensor_torque))
      record.column(record::Channel::sensor_torque).push_back(o.sensor_torque);
    if (!std::isnan(o.motor_current))
      record.column(record::Channel::motor_current).push_back(o.motor_current);
    if (!std::isnan(o.acceleration)) record.column(record::Channel::acceleration).push_back(o.acceleration);
  }
  if (progress) progress(1, "simulating");
  return record;
}

}  // namespace backlash::simulation
