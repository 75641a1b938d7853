// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/geared_arm/plant.h"

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

void append(record::Record& record, simulation::SensorModel& sensors, const model::Observation& exact) {
  for (const Column& column : kColumns) {
    const double value = exact.*column.value;
    if ((column.always || sensors.settings().of(column.channel).declared) && std::isfinite(value))
      record.column(column.channel).push_back(sensors.measure(column.channel, value));
  }
}

}  // namespace

std::vector<record::JointRecord> simulate_arm(const GearedArm& arm, double duration,
                                              const Progress& progress) {
  if (!arm.simulated)
    throw BadData(arm.rig.source, "has no `simulation`: sensors and gravity_compensation are not known");
  const double rate = arm.sensors.sampling_rate, samples = std::round(duration * rate);
  if (!(samples >= 1) || samples > double(kMostSamples))
    throw InvalidParameter("duration", duration, "must give from 1 to 1e9 samples at this sampling rate");
  ArmPlant plant(arm);
  std::vector<record::JointRecord> records;
  std::vector<simulation::SensorModel> sensors;
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    records.push_back({arm.rig.joints[j].name, {}});
    records.back().record.name = arm.rig.name;
    simulation::SensorsSettings settings = arm.sensors;
    settings.seed += j;
    sensors.emplace_back(settings);
  }
  for (long i = 0; i < long(samples); ++i) {
    if (progress && i % kSamplesPerReport == 0 && !progress(double(i) / samples, "simulating"))
      throw Cancelled();
    plant.advance_to(double(i) / rate);
    for (std::size_t j = 0; j < records.size(); ++j) {
      records[j].record.time.push_back(double(i) / rate);
      append(records[j].record, sensors[j], plant.observe(j));
    }
  }
  return records;
}

}  // namespace backlash::geared_arm
