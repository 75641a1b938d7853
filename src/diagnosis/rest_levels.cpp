// SPDX-License-Identifier: BSD-3-Clause
#include "rest_levels.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::diagnosis {
namespace {

// Choices: samples of a window; shares of the travel of motor minus load that a window at rest may move by
// and be wide; share of all windows that must be at rest; windows of a level, at least; shares of the largest
// torque from which a flank is pressed, and below which none is; share of the distance that a level may be
// wide.
constexpr std::size_t kWindow = 10;
constexpr double kMoves = 0.02, kWide = 0.1, kMostly = 0.5;
constexpr std::size_t kFewest = 5;
constexpr double kPressed = 0.5, kIdle = 0.25, kLevel = 0.2;
constexpr double kLargest = 0.95, kTail = 0.05;  // quantiles

struct Window {
  double deflection, torque;
};

double mean(const std::vector<double>& x, std::size_t from, std::size_t count) {
  double sum = 0;
  for (std::size_t i = from; i < from + count; ++i) sum += x[i];
  return sum / double(count);
}

/// As far as matters to a distance of the levels of `size`.
bool rests(const std::vector<double>& x, std::size_t from, double size) {
  const auto [least, most] = std::minmax_element(x.begin() + long(from), x.begin() + long(from + kWindow));
  const double moved = mean(x, from + kWindow / 2, kWindow / 2) - mean(x, from, kWindow / 2);
  return *most - *least <= kWide * size && std::fabs(moved) <= kMoves * size;
}

RestLevel level_of(const std::vector<Window>& windows) {
  std::vector<double> deflection, torque;
  for (const Window& w : windows) deflection.push_back(w.deflection), torque.push_back(w.torque);
  RestLevel level;
  level.windows = windows.size();
  level.spread = 0.5 * signal::quantile_range(deflection, kTail);
  level.deflection = signal::median(std::move(deflection));
  level.torque = signal::median(std::move(torque));
  return level;
}

}  // namespace

std::optional<RestLevels> rest_levels(const TwoEncoders& motion) {
  const std::size_t n = motion.motor.size();
  std::vector<double> apart;
  for (std::size_t i = 0; i < n; ++i) apart.push_back(motion.motor[i] - motion.load[i]);
  if (n < kWindow) return std::nullopt;
  const double size = signal::quantile_range(apart, 0.01);
  std::vector<Window> windows;
  for (std::size_t i = 0; i + kWindow <= n; i += kWindow)
    if (rests(motion.motor, i, size) && rests(motion.load, i, size))
      windows.push_back({mean(apart, i, kWindow), mean(motion.torque, i, kWindow)});
  if (windows.empty() || double(windows.size() * kWindow) < kMostly * double(n)) return std::nullopt;
  std::vector<double> torques;
  for (const Window& w : windows) torques.push_back(std::fabs(w.torque));
  const double largest = signal::quantile(std::move(torques), kLargest);
  std::vector<Window> up, down, idle;
  for (const Window& w : windows) {
    if (std::fabs(w.torque) >= kPressed * largest) (w.torque > 0 ? up : down).push_back(w);
    if (std::fabs(w.torque) <= kIdle * largest) idle.push_back(w);
  }
  RestLevels levels;
  if (up.size() < kFewest) std::swap(up, down), levels.side = -1;
  const std::vector<Window>& other = down.size() < kFewest ? idle : down;
  if (up.size() < kFewest || other.size() < kFewest || !(largest > 0)) return std::nullopt;
  levels.pressed = level_of(up);
  levels.other = level_of(other);
  const double widest = std::max(levels.pressed.spread, levels.other.spread);
  if (!(levels.apart() > 0) || widest > kLevel * levels.apart()) return std::nullopt;
  return levels;
}

bool read_at_rest(const TwoEncoders& motion, const PositionDifferenceSettings& settings, Estimate& estimate) {
  const auto levels = rest_levels(motion);
  if (!levels) return false;
  const double yields = std::abs(settings.elastic_deflection(levels->pressed.torque)) +
                        std::abs(settings.elastic_deflection(levels->other.torque));
  const double share = std::hypot(settings.elastic_uncertainty, settings.declared_uncertainty);
  const double at_most = (1 + share) * yields, apart = levels->apart();
  if (!(apart > at_most)) return false;
  const double half = 2 * std::hypot(levels->pressed.spread, levels->other.spread);
  estimate.status = Status::ok;
  estimate.backlash_angle = apart;
  estimate.angle_lower = std::max(0.0, apart - half);
  estimate.angle_upper = apart + half;
  estimate.backlash = settings.base_radius * estimate.backlash_angle;
  estimate.lower = settings.base_radius * estimate.angle_lower;
  estimate.upper = settings.base_radius * estimate.angle_upper;
  estimate.deflection = at_most;
  estimate.components.emplace();
  estimate.components->gap = apart - yields;
  estimate.components->at_torque = std::abs(levels->pressed.torque);
  if (levels->pressed.torque != 0)
    estimate.components->compliance =
        std::abs(settings.elastic_deflection(levels->pressed.torque) / levels->pressed.torque);
  estimate.message = fmt::format(
      "read at rest, {} and {} windows: motor minus load is {:.4g} rad apart between {:.3g} and {:.3g} N m, "
      "of which the "
      "teeth yield {:.3g} rad as declared, {:.3g} rad at most, and the rest is free play; motion under loads "
      "of both "
      "signs would separate them",
      levels->pressed.windows, levels->other.windows, apart, levels->pressed.torque, levels->other.torque,
      yields, at_most);
  return true;
}

}  // namespace backlash::diagnosis
