// SPDX-License-Identifier: BSD-3-Clause
// Records of a rig that can be written down: square torque, a sensor and a motor that ring after each switch.
#pragma once

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::test {

struct RecordRecipe {
  double duration = 1.5, rate = 1000, start = 0;  // s, Hz, s
  double frequency = 10, amplitude = 0.05;        // Hz, N m
  double travel = 0.01;                           // rad, of the motor from wall to wall
  double noise = 0;                               // N m, of the sensor
  double jitter = 0;                              // of the stamps, in samples
  double idle = 0;                                // s without torque at the start
};

inline record::Record make_record(const RecordRecipe& recipe) {
  record::Record record;
  record.name = "recipe";
  Random random(17);
  const auto count = static_cast<int>(std::lround(recipe.duration * recipe.rate));
  for (int i = 0; i < count; ++i) {
    const double shift = std::clamp(recipe.jitter * random.normal(), -0.45, 0.45);
    const double t = i / recipe.rate - recipe.idle;
    const double half = 2 * recipe.frequency * t + 1e-9;  // a switch at a sample acts from that sample on
    const double since = (half - std::floor(half)) / (2 * recipe.frequency);
    const double sign = t < 0 ? 0 : std::fmod(std::floor(half), 2) == 0 ? 1 : -1;
    const double ring = std::exp(-since / 0.01) * std::cos(2 * M_PI * 130 * since);
    record.time.push_back(recipe.start + (i + shift) / recipe.rate);
    record.column(record::Channel::motor_torque).push_back(recipe.amplitude * sign);
    record.column(record::Channel::motor_position).push_back(0.5 * recipe.travel * sign * (1 - 0.2 * ring));
    record.column(record::Channel::sensor_torque)
        .push_back(recipe.amplitude * sign * (1 - 2 * ring) + recipe.noise * random.normal());
    record.column(record::Channel::load_position).push_back(0);
  }
  return record;
}

inline record::ChannelValues values_at(const record::Record& record, std::size_t i) {
  record::ChannelValues values;
  for (const record::Channel channel : record::kChannels)
    values[static_cast<std::size_t>(channel)] =
        record.has(channel) ? record.column(channel)[i] : std::nan("");
  return values;
}

/// Removes samples [from, to).
inline void cut_out(record::Record& record, std::ptrdiff_t from, std::ptrdiff_t to) {
  record.time.erase(record.time.begin() + from, record.time.begin() + to);
  for (const record::Channel channel : record::kChannels)
    if (auto& column = record.column(channel); !column.empty())
      column.erase(column.begin() + from, column.begin() + to);
}

}  // namespace backlash::test
