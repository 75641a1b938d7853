// SPDX-License-Identifier: BSD-3-Clause
// From exact to measured values: offset, noise, saturation, quantisation.
//
//   measured = round(clamp(exact + offset + noise, -limit, limit) / resolution) * resolution
//
// with -exact for a sensor that is `reversed`.
//
// Each channel draws from a generator of its own, so that a sensor added or removed leaves the others' noise
// unchanged.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::simulation {

struct SensorSettings {
  double noise = 0;       // standard deviation, white Gaussian, unit of the channel
  double resolution = 0;  // width of a step; 0: none
  double offset = 0;
  double limit = std::numeric_limits<double>::infinity();  // saturation at +-limit
  bool declared =
      false;  // in the rig file; motor_current, acceleration and output_torque are recorded only then
  bool reversed = false;  // shows the negative of what the channel means
};

/// All sensors of a rig, and how they sample.
struct SensorsSettings {
  double sampling_rate = 1000;  // Hz
  std::uint64_t seed = 1;
  bool seeded = true;  // false: the rig file states no seed, and there is no noise without
  std::array<SensorSettings, record::kChannelCount> channels;  // indexed by Channel

  const SensorSettings& of(record::Channel channel) const {
    return channels[static_cast<std::size_t>(channel)];
  }
  SensorSettings& of(record::Channel channel) { return channels[static_cast<std::size_t>(channel)]; }
};

SensorsSettings read_sensors(const YamlReader& yaml);

class SensorModel {
 public:
  /// Throws InvalidParameter for noise without a seed.
  explicit SensorModel(const SensorsSettings& settings);

  /// Starts the noise again from the seed.
  void reset();

  /// Another standard deviation from the next value on; throws InvalidParameter unless it is >= 0.
  void set_noise(record::Channel channel, double noise);
  const SensorsSettings& settings() const { return settings_; }

  double measure(record::Channel channel, double exact);

  /// Every value of an observation through its sensor; a NaN (no such sensor) stays NaN.
  model::Observation measure(const model::Observation& exact);

 private:
  void seed(std::size_t channel);

  SensorsSettings settings_;
  std::array<std::optional<Random>, record::kChannelCount>
      noise_;  // of channels that have noise: seeding costs
};

}  // namespace backlash::simulation
