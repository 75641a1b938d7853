// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/simulation/sensor_model.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"

namespace backlash::simulation {
namespace {

SensorSettings read_sensor(const YamlReader& yaml) {
  SensorSettings sensor;
  sensor.declared = true;
  sensor.noise = yaml.number_or("noise", 0, Range::not_negative());
  sensor.resolution = yaml.number_or("resolution", 0, Range::not_negative());
  sensor.offset = yaml.number_or("offset", 0, Range::any());
  sensor.reversed = yaml.boolean_or("reversed", false);
  if (yaml.has("limit")) sensor.limit = yaml.number("limit", Range::positive());
  return sensor;
}

}  // namespace

SensorsSettings read_sensors(const YamlReader& yaml) {
  SensorsSettings settings;
  settings.sampling_rate = yaml.number("sampling_rate", Range::positive());
  settings.seeded = yaml.has("seed");
  if (settings.seeded) settings.seed = static_cast<std::uint64_t>(yaml.integer("seed", 0, 1L << 53));
  for (record::Channel channel : record::kChannels)
    if (const auto sensor = yaml.optional_map(record::channel_name(channel)))
      settings.of(channel) = read_sensor(*sensor);
  return settings;
}

SensorModel::SensorModel(const SensorsSettings& settings) : settings_(settings) {
  reset();
}

void SensorModel::reset() {
  for (std::size_t i = 0; i < record::kChannelCount; ++i)
    if (settings_.channels[i].noise > 0) seed(i);
}

void SensorModel::seed(std::size_t channel) {
  if (!settings_.seeded)
    throw InvalidParameter("sensors.seed", "absent",
                           "noise is drawn from it: give one in the rig file, or --seed");
  noise_[channel].emplace(settings_.seed, static_cast<std::uint32_t>(channel));
}

void SensorModel::set_noise(record::Channel channel, double noise) {
  const Range range = Range::not_negative();
  if (!std::isfinite(noise) || !range.contains(noise))
    throw InvalidParameter(record::channel_name(channel) + " noise", noise, range.text());
  double& present = settings_.of(channel).noise;
  if (present == 0 && noise > 0) seed(static_cast<std::size_t>(channel));
  present = noise;
}

double SensorModel::measure(record::Channel channel, double exact) {
  const std::size_t i = static_cast<std::size_t>(channel);
  const SensorSettings& sensor = settings_.channels[i];
  double value = (sensor.reversed ? -exact : exact) + sensor.offset;
  if (sensor.noise > 0) value += sensor.noise * noise_[i]->normal();
  value = std::clamp(value, -sensor.limit, sensor.limit);
  if (sensor.resolution > 0) value = std::round(value / sensor.resolution) * sensor.resolution;
  return std::isnan(exact) ? exact : value;
}

model::Observation SensorModel::measure(const model::Observation& exact) {
  model::Observation measured = exact;  // the twist has no sensor of its own
  measured.motor_torque = measure(record::Channel::motor_torque, exact.motor_torque);
  measured.motor_position = measure(record::Channel::motor_position, exact.motor_position);
  measured.motor_velocity = measure(record::Channel::motor_velocity, exact.motor_velocity);
  measured.sensor_torque = measure(record::Channel::sensor_torque, exact.sensor_torque);
  measured.load_position = measure(record::Channel::load_position, exact.load_position);
  measured.load_velocity = measure(record::Channel::load_velocity, exact.load_velocity);
  const auto if_declared = [this](record::Channel channel, double value) {
    return settings_.of(channel).declared ? measure(channel, value) : std::nan("");
  };
  measured.motor_current = if_declared(record::Channel::motor_current, exact.motor_current);
  if (settings_.of(record::Channel::output_torque)
          .declared)  // else as it is: live joint states always had it
    measured.output_torque = measure(record::Channel::output_torque, exact.output_torque);
  measured.acceleration = if_declared(record::Channel::acceleration, exact.acceleration);
  return measured;
}

}  // namespace backlash::simulation
