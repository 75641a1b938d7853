// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/simulation.h"

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/not_a_number.h"

namespace backlash::geared_arm {
namespace {

using record::Channel;

constexpr long kMostSamples = 1'000'000'000L;
constexpr long kSamplesPerReport = 100;  // of progress

/// Channels that a record of an arm has, and where an observation holds them.
struct Column {
  Channel channel;
  double model::Observation::*value;
  bool always;
};
const Column kColumns[] = {{Channel::motor_torque, &model::Observation::motor_torque, true},
                           {Channel::motor_position, &model::Observation::motor_position, true},
                           {Channel::load_position, &model::Observation::load_position, true},
                           {Channel::motor_velocity, &model::Observation::motor_velocity, false},
                           {Channel::load_velocity, &model::Observation::load_velocity, false},
                           {Channel::motor_current, &model::Observation::motor_current, false},
                           {Channel::output_torque, &model::Observation::output_torque, false}};

model::Observation measured(const model::Observation& exact, simulation::SensorModel& sensors) {
  model::Observation sample = exact;
  for (const Column& column : kColumns) {
    const bool seen = column.always || sensors.settings().of(column.channel).declared;
    double& value = sample.*column.value;
    value = seen && std::isfinite(value) ? sensors.measure(column.channel, value) : kNaN;
  }
  return sample;
}

void append(record::Record& record, double time, const model::Observation& sample) {
  record.time.push_back(time);
  for (const Column& column : kColumns)
    if (const double value = sample.*column.value; std::isfinite(value))
      record.column(column.channel).push_back(value);
}

}  // namespace

ArmSimulation::ArmSimulation(const GearedArm& arm) : arm_(arm) {
  if (!arm_.simulated)
    throw BadData(arm_.rig.source, "has no `simulation`: sensors and gravity_compensation are not known");
  for (std::size_t j = 0; j < arm_.joints.size(); ++j) {
    simulation::SensorsSettings settings = arm_.sensors;
    settings.seed += j;
    sensors_.emplace_back(settings);
  }
  reset();
}

void ArmSimulation::reset() {
  plant_ = std::make_unique<ArmPlant>(arm_);
  for (simulation::SensorModel& sensors : sensors_) sensors.reset();
  index_ = 0;
}

std::vector<model::Observation> ArmSimulation::step() {
  plant_->advance_to(double(index_) / sampling_rate());
  std::vector<model::Observation> samples;
  for (std::size_t j = 0; j < sensors_.size(); ++j)
    samples.push_back(measured(plant_->observe(j), sensors_[j]));
  ++index_;
  return samples;
}

std::vector<record::JointRecord> simulate_arm(const GearedArm& arm, double duration,
                                              const Progress& progress) {
  ArmSimulation simulation(arm);
  const double rate = simulation.sampling_rate(), samples = std::round(duration * rate);
  if (!(samples >= 1) || samples > double(kMostSamples))
    throw InvalidParameter("duration", duration, "must give from 1 to 1e9 samples at this sampling rate");
  std::vector<record::JointRecord> records;
  for (const arm::JointDrive& joint : arm.rig.joints) {
    records.push_back({joint.name, {}});
    records.back().record.name = arm.rig.name;
  }
  for (long i = 0; i < long(samples); ++i) {
    if (progress && i % kSamplesPerReport == 0 && !progress(double(i) / samples, "simulating"))
      throw Cancelled();
    const std::vector<model::Observation> sample = simulation.step();
    for (std::size_t j = 0; j < records.size(); ++j) append(records[j].record, double(i) / rate, sample[j]);
  }
  return records;
}

}  // namespace backlash::geared_arm
