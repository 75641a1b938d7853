// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/lost_motion.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/hysteresis_loop.h"
#include "backlash_diagnosis/diagnosis/signal_checks.h"
#include "backlash_diagnosis/diagnosis/wall_reading.h"
#include "backlash_diagnosis/diagnosis/wall_to_wall.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "refusal.h"
#include "same_throughout.h"

namespace backlash::diagnosis {
namespace {

constexpr double kReached = 0.95;         // torque counts as reached from this fraction of the stated level
constexpr double kLevelFromRecord = 0.9;  // where no level is stated, of the torque typical of the record
constexpr double kTorqueSpan = 0.1;       // change of torque within a reading, fraction of the stated level
// Where deflection is subtracted, any torque that keeps contact will do and a longer window averages more
// ringing; fraction of the stated level.
constexpr double kReadLevelFree = 0.5;
// The motor is not at rest at the walls if ringing and settling make this share of the travel uncertain, ...
constexpr double kUnsettled = 0.1;
// ... or if rms ringing is this share of the elastic deflection, so that the flank is left again.
constexpr double kAssumedLoss = 0.5;
// Ramps whose peaks are so many times the stated torque: dry friction holds what the peak has wound up.
constexpr double kFarBeyond = 1.5;  // choice
constexpr std::size_t kFewest = 2;  // excursions per side
// Torque in the sensor rings with the motor, so that its excursions need not be those of the excitation. It
// is not trusted with this share of deviating passages, or with so many times more excursions than half
// cycles.
constexpr double kManyOutliers = 0.15;
constexpr double kManyExcursions = 1.25;

void check(const LostMotionSettings& settings) {
  const bool from_record = std::isnan(settings.torque) && settings.subtract_elastic_deflection;
  if (!from_record && !(settings.torque > 0 && std::isfinite(settings.torque))) {
    throw InvalidParameter("lost_motion.torque", settings.torque, "must be > 0");
  }
  if (settings.subtract_elastic_deflection && !settings.elastic_deflection) {
    throw InvalidParameter("lost_motion.elastic_deflection", "empty",
                           "needed to subtract the elastic deflection");
  }
  if (!(settings.elastic_uncertainty >= 0)) {
    throw InvalidParameter("lost_motion.elastic_uncertainty", settings.elastic_uncertainty, "must be >= 0");
  }
  if (settings.base_radius <= 0) {
    throw InvalidParameter("lost_motion.base_radius", settings.base_radius, "must be > 0");
  }
  if (settings.locked_tolerance <= 0) {
    throw InvalidParameter("lost_motion.locked_tolerance", settings.locked_tolerance, "must be > 0");
  }
}

double travel(const std::vector<double>& values) {
  return signal::quantile_range(values, 0.01);
}

LockedMotion collect(const record::Record& record, const LostMotionSettings& settings) {
  const std::vector<double>& position = record.column(record::Channel::motor_position);
  const bool motor = record.has(record::Channel::motor_torque);
  const std::vector<double>& torque =
      record.column(motor ? record::Channel::motor_torque : record::Channel::sensor_torque);
  if (position.empty()) throw Refusal{Status::insufficient_data, "the record has no motor_position"};
  if (torque.empty())
    throw Refusal{Status::insufficient_data, "the record has neither motor_torque nor sensor_torque"};
  const std::vector<double>& sensor = record.column(record::Channel::sensor_torque);
  const bool both = motor && sensor.size() == torque.size() &&
                    std::all_of(sensor.begin(), sensor.end(), [](double t) { return std::isfinite(t); });
  LockedMotion motion;
  for (std::size_t i = 0; i < std::min({record.time.size(), position.size(), torque.size()}); ++i) {
    if (!std::isfinite(record.time[i]) || !std::isfinite(position[i]) || !std::isfinite(torque[i])) continue;
    if (both) motion.sensor.push_back(sensor[i]);
    motion.time.push_back(record.time[i]);
    motion.torque.push_back(torque[i]);
    motion.position.push_back(position[i]);
  }
  if (motion.time.empty()) throw Refusal{Status::insufficient_data, "the record has no finite samples"};

  std::vector<double> load;
  for (const double value : record.column(record::Channel::load_position)) {
    if (std::isfinite(value)) load.push_back(value);
  }
  if (!load.empty()) {
    const double moved = travel(load);
    const double tolerance =
        std::isnan(settings.locked_tolerance) ? 0.05 * travel(motion.position) : settings.locked_tolerance;
    if (moved > tolerance) {
      throw Refusal{
          Status::out_of_domain,
          fmt::format("the output is not locked: load_position moves by {:.4g} rad, allowed {:.4g} rad",
                      moved, tolerance)};
    }
  }
  return motion;
}

struct Walls {
  double level = 0;  // N m, stated
  bool switched = false;
  std::vector<TorqueExcursion> excursions;
  std::vector<WallReading> readings;
};

// Torque reached on the negative and on the positive side; the percentile leaves out peaks of noise.
std::array<double, 2> reached_torque(const LockedMotion& motion, double fraction) {
  return {-signal::quantile(motion.torque, 1 - fraction), signal::quantile(motion.torque, fraction)};
}

std::array<std::size_t, 2> count_sides(const std::vector<TorqueExcursion>& excursions) {
  std::array<std::size_t, 2> count = {0, 0};
  for (const TorqueExcursion& excursion : excursions) ++count[excursion.side > 0];
  return count;
}

// `excursions` are those beyond kReached * level. Noise may hide short ones, a percentile may miss rare ones.
void require_reached(const LockedMotion& motion, const std::vector<TorqueExcursion>& excursions,
                     double level) {
  const auto count = count_sides(excursions);
  const auto reached = reached_torque(motion, 0.99);
  for (const std::size_t side : {0, 1}) {
    if (count[side] > 0 || reached[side] >= kReached * level) continue;
    throw Refusal{Status::out_of_domain,
                  fmt::format("torque reaches {:.4g} N m and {:.4g} N m, needed are +-{:.4g} N m", reached[1],
                              -reached[0], level)};
  }
}

void require_count(const std::vector<TorqueExcursion>& excursions, double level) {
  const auto count = count_sides(excursions);
  if (std::min(count[0], count[1]) >= kFewest) return;
  throw Refusal{Status::insufficient_data,
                fmt::format("torque goes clearly beyond {:.4g} N m and comes back {} times, beyond {:.4g} N "
                            "m {} times; needed are {} each",
                            level, count[1], -level, count[0], kFewest)};
}

Walls read_walls(const LockedMotion& motion, const LostMotionSettings& settings) {
  Walls walls;
  walls.level = settings.torque;
  if (std::isnan(walls.level)) {
    const auto typical = reached_torque(motion, 0.875);  // three quarters of each side's half of the time
    walls.level = kLevelFromRecord * std::min(typical[0], typical[1]);
    if (!(walls.level > 0)) throw Refusal{Status::out_of_domain, "torque does not go to both signs"};
  }
  walls.excursions = find_excursions(motion.torque, kReached * walls.level);
  require_reached(motion, walls.excursions, walls.level);
  double read_level = kReached * walls.level, torque_span = kTorqueSpan * walls.level;
  if (settings.subtract_elastic_deflection) {
    read_level = kReadLevelFree * walls.level;
    torque_span = std::numeric_limits<double>::infinity();
    walls.excursions = find_excursions(motion.torque, read_level);
  }
  require_count(walls.excursions, read_level);
  for (std::size_t i = 0; i < walls.excursions.size(); ++i) {
    const bool last = i + 1 == walls.excursions.size();
    const std::size_t limit = last ? motion.torque.size() : walls.excursions[i + 1].begin;
    walls.readings.push_back(read_wall(motion, walls.excursions[i], read_level, torque_span, limit));
  }
  walls.switched = is_switched(walls.excursions, walls.readings);
  return walls;
}

// To subtract per reading: all deflection, or that of torque beyond the stated level where torque is switched
// past it, or none.
std::vector<double> deflections_of(const Walls& walls, const LostMotionSettings& settings, bool exceeds) {
  std::vector<double> deflections(walls.readings.size(), 0.0);
  if (!settings.subtract_elastic_deflection && !exceeds) return deflections;
  const double stated = exceeds ? settings.elastic_deflection(walls.level) : 0;
  for (std::size_t i = 0; i < deflections.size(); ++i) {
    deflections[i] = settings.elastic_deflection(walls.readings[i].torque) - stated;
  }
  return deflections;
}

void require_rest(const WallToWall& play, double deflection) {
  const bool settled = play.motion <= kUnsettled * std::abs(play.travel);
  const bool touching = deflection == 0 || play.ringing <= kAssumedLoss * deflection;
  if (settled && touching) return;
  throw Refusal{Status::out_of_domain,
                fmt::format("the motor does not come to rest at the walls: its position varies by {:.4g} rad "
                            "rms there (travel {:.4g} rad); apply torque more slowly",
                            play.ringing, play.travel)};
}

void require_calm_sensor(const LockedMotion& motion, const Walls& walls, const WallToWall& play) {
  const double period = detect_period(motion.time, motion.torque).value_or(0);
  const double cycles = period > 0 ? 2 * (motion.time.back() - motion.time.front()) / period : 0;
  const bool too_many = cycles > 0 && double(walls.excursions.size()) > kManyExcursions * cycles + 1;
  if (!too_many && double(play.outliers) <= kManyOutliers * double(play.plays.size())) return;
  throw Refusal{Status::out_of_domain,
                "sensor_torque rings where the walls are read (" + std::to_string(walls.excursions.size()) +
                    " excursions, " + std::to_string(play.outliers) + " of " +
                    std::to_string(play.plays.size()) +
                    " passages far from the others) and the record has no motor_torque to go by"};
}

/// N m: torque at the walls by the torque sensor, without its offset; NaN without a sensor.
double torque_by_sensor(const Walls& walls) {
  std::vector<double> of_side[2];
  for (const WallReading& reading : walls.readings)
    if (std::isfinite(reading.sensor)) of_side[reading.side > 0].push_back(reading.sensor);
  if (of_side[0].empty() || of_side[1].empty()) return kNaN;
  return 0.5 * (signal::median(std::move(of_side[0])) + signal::median(std::move(of_side[1])));
}

/// rad, of both sides: by how much less or more than at `torque` the flanks yield if they hold what the
/// torque sensor says: dry friction, a drive that gives other than it says, or a wrong sensor.
double doubt_by_sensor(double torque, double by_sensor, const LostMotionSettings& settings) {
  if (!settings.subtract_elastic_deflection || std::isnan(by_sensor)) return 0;
  return 2 * std::abs(settings.elastic_deflection(torque) -
                      settings.elastic_deflection(std::max(0.0, by_sensor)));
}

/// rad, of both sides: how much farther apart the walls are on the way back from peaks far beyond the stated
/// torque than on the way there; 0 without such peaks. Dry friction hinders the one and holds the other.
double held_from_peaks(const Walls& walls, const LostMotionSettings& settings) {
  if (settings.subtract_elastic_deflection || walls.switched) return 0;
  if (median_of(walls.readings, &WallReading::peak) < kFarBeyond * walls.level) return 0;
  std::vector<double> of_side[2];
  for (const WallReading& r : walls.readings)
    of_side[r.side > 0].push_back(r.side * (r.position - r.arrival));
  return std::max(0.0, signal::median(std::move(of_side[0])) + signal::median(std::move(of_side[1])));
}

struct Parts {
  PlayComponents components;
  double flank_friction = kNaN;  // N m
  std::string missing;
};

Parts find_parts(LockedMotion motion, const Walls& walls, const LostMotionSettings& settings,
                 const WallToWall& play) {
  Parts parts;
  if (walls.switched) {
    parts.missing =
        "torque is switched between two levels, so the record holds neither compliance nor friction";
    if (settings.subtract_elastic_deflection) {
      parts.components.gap = std::max(0.0, play.value);
    } else if (settings.elastic_deflection) {
      parts.components.gap = std::max(0.0, play.value - 2 * settings.elastic_deflection(walls.level));
    } else {
      parts.missing += ", and without elastic deflection no gap";
    }
    return parts;
  }
  const double drift = drift_rate(walls.readings);
  for (std::size_t i = 0; i < motion.time.size(); ++i) {
    motion.position[i] -= drift * (motion.time[i] - motion.time[0]);
  }
  std::vector<double> positions[2];
  for (const WallReading& reading : walls.readings) {
    positions[reading.side > 0].push_back(reading.position - drift * (reading.time - motion.time[0]));
  }
  const double lower = signal::median(positions[0]), upper = signal::median(positions[1]);
  if (!(lower < upper)) {
    parts.missing = "the walls scatter more than they are apart, so the hysteresis loop has no parts";
    return parts;
  }
  HysteresisLoop loop = analyse_hysteresis(motion, walls.excursions, lower, upper);
  parts.components = loop.components;
  if (settings.subtract_elastic_deflection) parts.components.gap = std::max(0.0, play.value);
  parts.flank_friction = loop.flank_friction;
  parts.missing = loop.missing;
  return parts;
}

std::string describe(const Walls& walls, const LostMotionSettings& settings, const WallToWall& play,
                     const Parts& parts) {
  std::string message = settings.subtract_elastic_deflection
                            ? fmt::format("free play without elastic deflection, read at {:.4g} N m",
                                          median_of(walls.readings, &WallReading::torque))
                            : fmt::format("play from wall to wall at +-{:.4g} N m", walls.level);
  message += ", median of " + std::to_string(play.plays.size()) + " passages";
  if (play.outliers > 0) {
    message += ", " + std::to_string(play.outliers) +
               " of them far from the others (slips), the interval is wider for it";
  }
  if (!parts.missing.empty()) message += "; " + parts.missing;
  return message;
}

void fill(const record::Record& record, const LostMotionSettings& settings, Estimate& estimate) {
  const LockedMotion motion = collect(record, settings);
  const Walls walls = read_walls(motion, settings);
  const double torque = median_of(walls.readings, &WallReading::torque);
  const bool exceeds = !settings.subtract_elastic_deflection && torque > (1 + kTorqueSpan) * walls.level;
  if (exceeds && !settings.elastic_deflection) {
    throw Refusal{Status::out_of_domain, fmt::format("torque jumps past the stated {:.4g} N m to {:.4g} N m, "
                                                     "and no elastic deflection is known to correct for it",
                                                     walls.level, torque)};
  }
  const std::vector<double> deflections = deflections_of(walls, settings, exceeds);
  const WallToWall play = measure_wall_to_wall(motion, walls.readings, deflections, walls.switched);
  require_rest(play, settings.subtract_elastic_deflection ? signal::median(deflections) : 0);
  if (!record.has(record::Channel::motor_torque)) require_calm_sensor(motion, walls, play);
  if (!(play.travel > 0)) {
    throw Refusal{Status::out_of_domain,
                  "positive torque moves the motor to smaller positions, or not at all"};
  }
  const Parts parts = find_parts(motion, walls, settings, play);
  double elastic = 2 * settings.elastic_uncertainty * std::abs(signal::median(deflections));
  double friction = 0;  // rad
  if (settings.subtract_elastic_deflection && parts.flank_friction > 0) {
    // Friction carries part of the torque, so the flank may hold less than the motor gives.
    const double carried = std::max(0.0, torque - parts.flank_friction);
    friction = 2 * (settings.elastic_deflection(torque) - settings.elastic_deflection(carried));
  }
  const double by_sensor = torque_by_sensor(walls);
  elastic += std::max(friction, doubt_by_sensor(torque, by_sensor, settings));
  const double read = std::hypot(play.half_interval(), elastic), held = held_from_peaks(walls, settings);
  const double value = play.value - 0.5 * held, half = read + 0.5 * held;
  if (value + half < 0) {
    throw Refusal{Status::out_of_domain,
                  fmt::format("the travel of {:.4g} rad is less than the elastic deflection that the rig "
                              "declares: the rig is not this machine, or the motor did not reach both walls",
                              play.travel)};
  }
  require_same_throughout(play.plays, read);
  estimate.status = Status::ok;
  // Friction on the flanks carries up to as much torque again to the walls.
  if (!settings.subtract_elastic_deflection && settings.elastic_deflection)
    estimate.deflection =
        2 * (1 + settings.elastic_uncertainty) * settings.elastic_deflection(2 * walls.level);
  estimate.backlash_angle = std::max(0.0, value);
  estimate.angle_lower = std::max(0.0, value - half);
  estimate.angle_upper = value + half;
  estimate.backlash = settings.base_radius * estimate.backlash_angle;
  estimate.lower = settings.base_radius * estimate.angle_lower;
  estimate.upper = settings.base_radius * estimate.angle_upper;
  estimate.declared = elastic;
  estimate.components = parts.components;
  estimate.components->at_torque = settings.subtract_elastic_deflection ? torque : walls.level;
  estimate.message = describe(walls, settings, play, parts);
  if (held > 0)
    estimate.message += fmt::format(
        "; the ramps go on to {:.4g} N m: on the way there the walls are {:.4g} rad apart, on the way back "
        "{:.4g} rad, as friction holds what the peaks wind up, and the interval holds both; ramps to little "
        "more than {:.4g} N m would separate them",
        median_of(walls.readings, &WallReading::peak), play.value - held, play.value, walls.level);
  if (settings.subtract_elastic_deflection && std::abs(by_sensor - torque) > kTorqueSpan * torque)
    estimate.message +=
        fmt::format("; by sensor_torque it is {:.4g} N m there, the interval holds both", by_sensor);
}

}  // namespace

Estimate estimate_lost_motion(const record::Record& record, const LostMotionSettings& settings) {
  check(settings);
  return estimate_or_refusal("lost_motion", [&](Estimate& estimate) { fill(record, settings, estimate); });
}

}  // namespace backlash::diagnosis
