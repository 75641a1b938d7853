// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/wall_to_wall.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust.h"

namespace backlash::diagnosis {
namespace {

constexpr double kShortPassage = 0.1;  // passage between the sides over length of an excursion
constexpr double kSwitchChange = 0.2;  // change of torque in the last third of an excursion over torque
// Largest ratio of spreads half a window apart that is still taken for dying ringing.
constexpr double kLargestDecay = 0.7;
// What ringing and settling leave unknown, as shares of the rms at one wall and of the settling
// extrapolation; they hold 95 % of the errors in simulations of a ringing rig. Without extrapolation the rms
// counts twice at each of the two walls.
constexpr double kSwitchedRinging = 0.25;
constexpr double kSettling = 0.3;
constexpr double kRampedRinging = 4.0;

// Longest over shortest excursion up to which all settle alike: choice.
constexpr double kAlikeHeld = 1.5;

/// Whether torque is held as long each time. Else the walls are at different stages of their ringing, and its
/// medians are of none of them.
bool held_alike(const std::vector<WallReading>& readings) {
  std::vector<double> held;
  for (const WallReading& r : readings) held.push_back(r.held);
  return signal::quantile(held, 0.9) <= kAlikeHeld * signal::quantile(held, 0.1);
}

// Extrapolation of the travel to the end of the ringing.
double settling(const std::vector<WallReading>& readings) {
  const double before = median_of(readings, &WallReading::earlier_spread);
  if (!(before > 0)) return 0;
  const double decay = std::min(median_of(readings, &WallReading::spread) / before, kLargestDecay);
  std::vector<double> changes;
  changes.reserve(readings.size());
  for (const WallReading& r : readings) changes.push_back(r.side * (r.position - r.earlier_position));
  return 2 * signal::median(changes) * decay / (1 - decay);
}

}  // namespace

double median_of(const std::vector<WallReading>& readings, double WallReading::*member) {
  std::vector<double> values;
  values.reserve(readings.size());
  for (const WallReading& reading : readings) values.push_back(reading.*member);
  return signal::median(std::move(values));
}

bool is_switched(const std::vector<TorqueExcursion>& excursions, const std::vector<WallReading>& readings) {
  std::vector<double> passage, length;
  for (std::size_t i = 1; i < excursions.size(); ++i) {
    if (excursions[i].side == excursions[i - 1].side) continue;
    passage.push_back(static_cast<double>(excursions[i].begin - excursions[i - 1].end));
    length.push_back(static_cast<double>(excursions[i].end - excursions[i].begin));
  }
  const double torque = median_of(readings, &WallReading::torque);
  const double change = median_of(readings, &WallReading::torque_change);
  return signal::median(passage) < kShortPassage * signal::median(length) && change < kSwitchChange * torque;
}

double drift_rate(const std::vector<WallReading>& readings) {
  std::vector<double> slopes;
  for (const int side : {1, -1}) {
    std::vector<const WallReading*> same;
    for (const WallReading& reading : readings) {
      if (reading.side == side) same.push_back(&reading);
    }
    const std::size_t lag = std::max<std::size_t>(1, same.size() / 2);
    for (std::size_t i = lag; i < same.size(); ++i) {
      slopes.push_back((same[i]->position - same[i - lag]->position) / (same[i]->time - same[i - lag]->time));
    }
  }
  return slopes.empty() ? 0 : signal::median(std::move(slopes));
}

double WallToWall::half_interval() const {
  return std::sqrt(scatter * scatter + motion * motion + step * step);
}

WallToWall measure_wall_to_wall(const LockedMotion& motion, const std::vector<WallReading>& readings,
                                const std::vector<double>& deflections, bool switched) {
  const double drift = drift_rate(readings);
  std::vector<double> travels, plays;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const WallReading &a = readings[i - 1], &b = readings[i];
    if (a.side == b.side) continue;
    travels.push_back(b.side * (b.position - a.position - drift * (b.time - a.time)));
    plays.push_back(travels.back() - deflections[i] - deflections[i - 1]);
  }
  WallToWall result;
  result.step = signal::smallest_step(motion.position);
  const signal::RobustScale scale =
      signal::robust_scale(plays, 2 * result.step);  // each wall may be off by one step
  const double extrapolation = switched ? settling(readings) : 0;
  const bool alike = held_alike(readings);
  result.value = scale.centre + (alike ? extrapolation : 0);
  result.travel = signal::median(travels);
  result.ringing = median_of(readings, &WallReading::ringing);
  result.motion = std::hypot((alike ? kSettling : 1) * extrapolation,
                             (switched ? kSwitchedRinging : kRampedRinging) * result.ringing);
  result.outliers = scale.outliers;
  // Neighbouring passages share a wall, so n walls make n/2 independent passages; a median scatters 1.25
  // times as much as a mean; two walls and the drift are fitted.
  const double n = static_cast<double>(readings.size());
  const double standard_error = 1.25 * scale.deviation * std::sqrt(2 / n);
  result.scatter = signal::student_t_quantile(0.975, std::max(1.0, n - 3)) * standard_error;
  result.plays = std::move(plays);
  return result;
}

}  // namespace backlash::diagnosis
