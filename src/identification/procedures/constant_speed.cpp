// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/constant_speed.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/blocks.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr std::size_t kLeastBlocks = 4;  // theory: for a standard error
constexpr double kSettled = 1e-4;        // choice: of the speed
constexpr double kMostSettling = 0.5;    // choice: of a stretch

void require(const ConstantSpeedOptions& options) {
  if (!(options.block > 0)) throw InvalidParameter("block", options.block, "must be > 0 s");
  if (!(options.least >= kLeastBlocks * options.block))
    throw InvalidParameter("least", options.least, "must be at least four blocks");
  if (!(options.spread > 0)) throw InvalidParameter("spread", options.spread, "must be > 0");
}

std::vector<double> speed_of(const record::Record& record, double interval) {
  if (record.has(record::Channel::motor_velocity)) return record.column(record::Channel::motor_velocity);
  if (record.has(record::Channel::motor_position))
    return signal::derivative(record.column(record::Channel::motor_position), interval);
  throw CannotIdentify(record.name + ": friction needs motor_velocity or motor_position");
}

/// First block after `first` that is too far from the speed of those before.
std::size_t stretch_end(const std::vector<double>& speed, std::size_t first, double spread) {
  double low = speed[first], high = low;
  std::size_t end = first;
  while (end < speed.size()) {
    low = std::min(low, speed[end]);
    high = std::max(high, speed[end]);
    if (!(high - low <= spread * std::min(std::fabs(low), std::fabs(high)))) break;
    ++end;
  }
  return end;
}

/// Mean of the blocks `first` to `end`, each `length` samples long.
signal::Measured mean_of(const std::vector<double>& values, std::size_t first, std::size_t end,
                         std::size_t length) {
  return signal::batch_mean({values.begin() + first * length, values.begin() + end * length});
}

}  // namespace

std::vector<ConstantSpeedRun> find_constant_speed(const record::Record& recorded,
                                                  const ConstantSpeedOptions& options) {
  require(options);
  if (!recorded.has(record::Channel::motor_torque))
    throw CannotIdentify(recorded.name + ": friction needs motor_torque");
  const record::Record record = record::evenly_sampled(recorded);
  const double interval = record.sampling_interval();
  const auto length = std::max<std::size_t>(1, std::lround(options.block / interval));
  const std::vector<double> speed = speed_of(record, interval), blocks = signal::block_means(speed, length);
  const std::vector<double>& torque = record.column(record::Channel::motor_torque);
  std::vector<ConstantSpeedRun> runs;
  for (std::size_t first = 0; first < blocks.size();) {
    const std::size_t end = stretch_end(blocks, first, options.spread);
    if (end < first + 3 || double(end - first - 2) * options.block < options.least) {
      ++first;
      continue;
    }
    const auto steady =
        signal::steady_range({blocks.begin() + first + 1, blocks.begin() + end - 1}, kMostSettling, kSettled);
    const std::size_t from = first + 1 + steady.first, to = first + 1 + steady.second;
    if (to < from + kLeastBlocks) {
      first = end;
      continue;
    }
    ConstantSpeedRun run{mean_of(speed, from, to, length), mean_of(torque, from, to, length),
                         record.time[from * length], record.time[to * length - 1]};
    if (std::fabs(run.speed.value) > 5 * run.speed.standard_error) runs.push_back(run);
    first = end;
  }
  if (runs.empty())
    throw CannotIdentify(
        fmt::format("{}: no {:.3g} s of constant speed (within {:.3g} %, in means of {:.3g} s)", record.name,
                    options.least, 100 * options.spread, options.block));
  return runs;
}

}  // namespace backlash::identification
