// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/declared_lock.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {
namespace {

// Choice: a worn joint may have more play than the limit at which it must stop, and stiffness may be off.
constexpr double kBeyondStop = 3, kSofter = 2;
constexpr double kTail = 0.001;  // choice: share of samples at either end that may be outliers

std::vector<double> finite(const std::vector<double>& values) {
  std::vector<double> kept;
  for (const double value : values)
    if (std::isfinite(value)) kept.push_back(value);
  return kept;
}

/// Travel [rad] of the motor; by tachometer after a constant offset of the speed is taken out.
double motor_travel(const record::Record& record) {
  const std::vector<double> position = finite(record.column(record::Channel::motor_position));
  if (!position.empty()) return signal::quantile_range(position, kTail);
  const std::vector<double> speed = finite(record.column(record::Channel::motor_velocity));
  if (speed.empty()) return kNaN;
  double offset = 0;
  for (const double w : speed) offset += w / static_cast<double>(speed.size());
  std::vector<double> angle;
  double sum = 0;
  for (const double w : speed) angle.push_back(sum += (w - offset) * record.sampling_interval());
  return signal::quantile_range(angle, kTail);
}

double largest_torque(const record::Record& record) {
  std::vector<double> torque = finite(record.column(record::Channel::motor_torque));
  if (torque.empty()) torque = finite(record.column(record::Channel::sensor_torque));
  if (torque.empty()) return kNaN;
  return std::max(std::fabs(signal::quantile(torque, kTail)), std::fabs(signal::quantile(torque, 1 - kTail)));
}

}  // namespace

double most_locked_travel(double play, double deflection) {
  return play + 2 * (deflection + std::sqrt(deflection * (4 * deflection + 2 * play)));
}

std::optional<std::string> lock_contradicted(const record::Record& record, const DeclaredLock& lock) {
  if (!lock.elastic_deflection || !(lock.play > 0)) return std::nullopt;
  const double torque = largest_torque(record), travel = motor_travel(record);
  if (!(torque > 0) || !std::isfinite(travel)) return std::nullopt;
  const double allowed =
      most_locked_travel(kBeyondStop * lock.play, kSofter * lock.elastic_deflection(torque));
  if (!(travel > allowed)) return std::nullopt;
  return fmt::format(
      "the rig file says that the output is locked, but the motor travels {:.4g} rad; under {:.4g} N m the "
      "declared compliance, and {:.3g} times the play at which the joint must stop, allow {:.4g} rad",
      travel, torque, kBeyondStop, allowed);
}

}  // namespace backlash::diagnosis
