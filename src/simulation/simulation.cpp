// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/simulation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::simulation {
namespace {

/// One sample of what was seen of torque, load and all else at moments of their own.
model::Observation together(const model::Observation& torque, model::Observation machine,
                            const model::Observation& load) {
  machine.motor_torque = torque.motor_torque;
  machine.motor_current = torque.motor_current;
  machine.load_position = load.load_position;
  machine.load_velocity = load.load_velocity;
  return machine;
}

}  // namespace

SimulationSettings read_simulation_settings(const YamlReader& yaml) {
  SimulationSettings settings;
  if (const auto excitation = yaml.optional_map("excitation"))
    settings.excitation = read_excitation(*excitation);
  else
    settings.excitation.type.clear();
  if (const auto sensors = yaml.optional_map("sensors"))
    settings.sensors = read_sensors(*sensors);
  else
    settings.sensors.sampling_rate = 0;
  if (const auto solver = yaml.optional_map("solver")) settings.solver = read_solver(*solver);
  return settings;
}

Simulation::Late Simulation::late(double delay, double rate) {
  // Rounding must not make one more sample of a delay of whole ones.
  constexpr double kRounding = 1e-9;  // samples
  const long samples = static_cast<long>(std::ceil(delay * rate - kRounding));
  return {delay, samples, std::max(0.0, double(samples) / rate - delay)};
}

Simulation::Simulation(const model::Rig& rig, const SimulationSettings& settings)
    : plant_(rig, settings.excitation, settings.solver),
      sensors_(settings.sensors),
      rate_(settings.sensors.sampling_rate) {
  if (!(rate_ > 0))
    throw InvalidParameter("sensors.sampling_rate", "absent",
                           "a simulation needs it: give `sensors` in the rig file");
  const double delay = model::sensing(rig.terms).torque_delay, skew = rig.encoder_skew;
  const double latest = std::min({0.0, delay, delay + skew});  // the torque is 0
  torque_ = late(-latest, rate_);
  motor_ = late(delay - latest, rate_);
  load_ = late(delay + skew - latest, rate_);
  forget();
}

void Simulation::forget() {
  const model::Observation rest = plant_.gear_train().observe(plant_.state().data(), model::AppliedTorque());
  for (Late* l : {&torque_, &motor_, &load_}) l->past.assign(l->samples, rest);
}

/// Moves on to the next sample, by way of the moments that later ones show.
model::Observation Simulation::observe() {
  std::array<Late*, 3> in_turn{&torque_, &motor_, &load_};
  std::sort(in_turn.begin(), in_turn.end(),
            [](const Late* a, const Late* b) { return a->after_sample < b->after_sample; });
  for (Late* l : in_turn) {
    if (l->samples == 0 || index_ == 0) continue;
    plant_.advance_to(double(index_ - 1) / rate_ + l->after_sample);
    l->past.push_back(plant_.observe());
  }
  plant_.advance_to(double(index_) / rate_);
  const model::Observation now = plant_.observe();
  const auto shown = [&](Late& l) {
    if (l.samples == 0) return now;
    const model::Observation before = l.past.front();
    l.past.pop_front();
    return before;
  };
  const model::Observation torque = shown(torque_), motor = shown(motor_);
  return together(torque, motor, shown(load_));
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
    if (settings.sensors.of(record::Channel::output_torque).declared && !std::isnan(o.output_torque))
      record.column(record::Channel::output_torque).push_back(o.output_torque);
    if (!std::isnan(o.acceleration)) record.column(record::Channel::acceleration).push_back(o.acceleration);
  }
  if (progress) progress(1, "simulating");
  return record;
}

}  // namespace backlash::simulation
