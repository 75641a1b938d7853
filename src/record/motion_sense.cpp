// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/motion_sense.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::record {
namespace {

constexpr double kFollows = 0.9;                             // choice: correlation of a load that moves along
constexpr double kLeastTravel = 0.8, kLargestTravel = 1.25;  // choice: gaps and deflections are far smaller
constexpr double kStandsStill = 0.05;                        // choice: of the travel of the other
constexpr double kBand = 20, kWidestBand = 0.1;              // Hz, of the sampling rate: choice
constexpr double kStands = 0.05;  // choice: of the rms speed, below which friction has no sign
// Shares of the torque that inertia and friction must be spent on for their signs to count. Late torques turn
// the sign of one of them, springs and gravity that of the other, none that of both.
constexpr double kInertiaShare = 0.1, kFrictionShare = 0.03;
constexpr double kMostSwings = 10;   // choice: of motor against load, between two samples
constexpr double kClearShare = 0.3;  // choice: of the torque, that an inertia must take to be estimated
constexpr double kHeavier = 10;      // choice: rig files are right within 40 %
constexpr double kNearUnit = 1.6;    // theory: of an inertia that the rig file has within 40 %
constexpr double kDegrees = 180 / M_PI, kMilli = 1000;
constexpr double kExplains = 0.8, kExplainsNot = 0.2;  // choice: share of a column that a regression explains
constexpr double kLags = 0.3;            // choice: share of the deflection, that follows the acceleration
constexpr double kOfPosition = 0.01;     // choice: share of the torque; no gear has so little friction
constexpr double kFewestMeetings = 100;  // choice: places that both directions of motion pass
constexpr std::size_t kFewest = 64;

Eigen::VectorXd varying(const std::vector<double>& x) {
  const Eigen::Map<const Eigen::VectorXd> v(x.data(), Eigen::Index(x.size()));
  return v.array() - v.mean();
}

std::vector<double> smoothed(const std::vector<double>& x, double interval) {
  return signal::low_pass(x, interval, std::min(kBand, kWidestBand / interval));
}

double root_mean_square(const std::vector<double>& x) {
  double square = 0;
  for (const double v : x) square += v * v / double(x.size());
  return std::sqrt(square);
}

void refuse(std::vector<Finding>& found, FindingKind kind, const char* channel, std::string message) {
  found.push_back({kind, channel, 0, 0, 1, std::move(message), Consequence::refused});
}

// --- the two positions

void look_at_travel(const DrivenMotion& m, const DeclaredMotion& declared, std::vector<Finding>& found) {
  const Eigen::VectorXd motor = varying(m.motor), load = varying(m.load);
  const double along = motor.dot(load), size = motor.norm() * load.norm();
  if (!(size > 0) || std::abs(along) < kFollows * size) return;
  const double times = std::copysign(load.norm() / motor.norm(), along);
  const double apart = std::abs(times - 1) * signal::peak_to_peak(m.motor);
  const double torque = signal::peak_to_peak(m.torque);
  // As with a motor that is held while the load is moved.
  if (declared.looseness && apart < kLooserThanDeclared * declared.looseness(torque)) return;
  if (times < 0)
    refuse(found, FindingKind::sign, "load_position",
           fmt::format("load_position turns against motor_position, {:.4g} times as far: the sign "
                       "of one of them is not that of the rig file; turn one of them (channels: scale: -1)",
                       -times));
  else if (std::fabs(times * declared.reduction_ratio * declared.reduction_ratio - 1) < kStandsStill &&
           declared.reduction_ratio != 1)
    refuse(found, FindingKind::swapped, "load_position",
           "load_position travels as motor_position should, and the reverse: the columns are in each other's "
           "place");
  else if (times < kLeastTravel || times > kLargestTravel)
    refuse(found, FindingKind::scale, "load_position",
           fmt::format("load_position travels {:.4g} times as far as motor_position, both seen from "
                       "the load: units, reduction_ratio or motor_side are not those of the record",
                       times));
}

/// q_M - q_L = o + s q_L + d w_L + e a_L: what accelerates the load is ahead of it, e > 0, by J_L / k. A load
/// encoder that is late by d adds -d^2 / 2.
void look_at_lag(const DrivenMotion& m, std::vector<Finding>& found) {
  const std::vector<double> motor = smoothed(m.motor, m.interval), load = smoothed(m.load, m.interval),
                            speed = signal::derivative(load, m.interval),
                            acceleration = signal::derivative(speed, m.interval);
  const auto n = Eigen::Index(load.size());
  Eigen::MatrixXd a(n, 4);
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = std::size_t(i);
    a.row(i) << 1, load[k], speed[k], acceleration[k];
    b[i] = motor[k] - load[k];
  }
  try {
    const Eigen::VectorXd with = signal::fit_linear(a, b).values;
    const double left = (b - a * with).squaredNorm();
    const Eigen::MatrixXd others = a.leftCols(3);
    const double before = (b - others * signal::fit_linear(others, b).values).squaredNorm();
    if (with[3] < -with[2] * with[2] && before - left > kLags * before)
      refuse(found, FindingKind::swapped, "load_position",
             "load_position is ahead of motor_position whenever both gain speed: the load would pull the "
             "motor; the "
             "columns are in each other's place");
  } catch (const CannotIdentify&) {  // a motion that does not distinguish them
  }
}

// --- what the torque is spent on

struct Driven {
  std::vector<double> torque, position, speed, acceleration;  // in the band
};

Driven driven(const std::vector<double>& torque, const std::vector<double>& position, double interval) {
  Driven d{smoothed(torque, interval), smoothed(position, interval), {}, {}};
  d.speed = signal::derivative(d.position, interval);
  d.acceleration = signal::derivative(d.speed, interval);
  return d;
}

/// Inertia, shares of inertia and friction in the torque, and the share of the torque that is left.
struct Spent {
  double inertia = 0, inertia_share = 0, friction_share = 0, left = 1;
};

/// All 0 of a motion that does not distinguish them. `weight`: it may also be spent on gravity or a spring.
Spent spent(const Driven& d, bool weight, bool linear) {
  const auto n = Eigen::Index(d.torque.size());
  const double stands = kStands * varying(d.speed).norm() / std::sqrt(double(n)),
               size = varying(d.torque).norm();
  Eigen::MatrixXd a(n, weight ? 6 : 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double w = d.speed[std::size_t(i)], q = d.position[std::size_t(i)];
    a.row(i).head(4) << d.acceleration[std::size_t(i)], w, std::abs(w) <= stands ? 0 : std::copysign(1, w), 1;
    if (weight) a.row(i).tail(2) << (linear ? q : std::sin(q)), (linear ? q * q : std::cos(q));
  }
  if (!(size > 0)) return {};
  try {
    const Eigen::VectorXd b = Eigen::Map<const Eigen::VectorXd>(d.torque.data(), n),
                          x = signal::fit_linear(a, b).values;
    const Eigen::VectorXd friction = a.middleCols(1, 2) * x.segment(1, 2);
    return {x[0], x[0] * a.col(0).norm() / size, friction.dot(a.col(1)) / (a.col(1).norm() * size),
            (b - a * x).squaredNorm() / (size * size)};
  } catch (const CannotIdentify&) {
    return {};
  }
}

const char* inertia_unit(bool linear) {
  return linear ? "kg" : "kg m^2";
}

void look_at_torque(const DrivenMotion& m, const Driven& d, bool linear, std::vector<Finding>& found) {
  const Spent on = spent(d, false, linear);
  if (on.inertia_share < -kInertiaShare && on.friction_share < -kFrictionShare)
    refuse(found, FindingKind::sign, "motor_torque",
           fmt::format("motor_torque works against the motion, as if the machine had an inertia of "
                       "{:.4g} {} and friction that drives: the sign of motor_torque or of "
                       "motor_position is not that of the rig file",
                       on.inertia, inertia_unit(linear)));
  if (on.left < kExplainsNot || spent(d, true, linear).left < kExplains) return;
  const Spent reversed = spent(driven(m.motor, m.torque, m.interval), false, linear);
  if (reversed.left < kExplainsNot && reversed.inertia > 0)
    refuse(found, FindingKind::swapped, "motor_torque",
           "motor_torque moves as a position under motor_position as torque, and not the reverse: the "
           "columns are in "
           "each other's place");
}

/// The unit that makes an inertia so many times as large; empty: none.
std::string unit_behind(double times, const DeclaredMotion& declared) {
  const auto near = [&](double factor) { return times < factor * kNearUnit && times > factor / kNearUnit; };
  const double ratio = declared.reduction_ratio;
  std::string units;
  const auto add = [&](double factor, const char* unit) {
    if (near(factor)) units += (units.empty() ? "" : ", or ") + std::string(unit);
  };
  if (!declared.linear) add(1 / kDegrees, "the positions are in degrees");
  add(1 / kMilli, declared.linear ? "the positions are in mm" : "the torque is in kN m");
  add(kMilli, declared.linear ? "the force is in mN" : "the torque is in N mm");
  if (ratio > kHeavier || ratio < 1 / kHeavier) {
    add(1 / ratio, "the torque is that of the motor's shaft");
    add(1 / (ratio * ratio), "torque and positions are those of the motor's shaft");
  }
  return units;
}

bool load_moves(const DrivenMotion& m) {
  return !m.load.empty() && signal::peak_to_peak(m.load) > kStandsStill * signal::peak_to_peak(m.motor);
}

void look_at_inertia(const DrivenMotion& m, const Driven& d, const DeclaredMotion& declared,
                     std::vector<Finding>& found) {
  // As of the motor by itself where the load stands; either where its position is not recorded.
  const bool with_load = declared.through_teeth && load_moves(m),
             unknown = declared.through_teeth && m.load.empty();
  const double inertia = declared.motor_inertia + (with_load ? declared.load_inertia : 0);
  if (!(inertia > 0)) return;
  const Spent on = spent(d, false, declared.linear);
  double times = on.inertia / inertia;
  if (unknown && times > 1) times = std::max(1.0, on.inertia / (inertia + declared.load_inertia));
  if (on.inertia_share < kClearShare || (times <= kHeavier && times >= 1 / kHeavier)) return;
  const double other =
      spent(d, true, declared.linear).inertia / on.inertia;  // a weight that swings looks like one
  const std::string units = other < kNearUnit && other > 1 / kNearUnit ? unit_behind(times, declared) : "";
  const std::string seen =
      fmt::format("motor_torque: {} is {:.3g} times what the rig file says: ",
                  declared.linear ? "the mass that it moves" : "the inertia that it moves", times);
  if (!units.empty())
    refuse(found, FindingKind::scale, "motor_torque",
           seen + units +
               "; say the unit in the name of the column, or "
               "in channels");
  else
    found.push_back(
        {FindingKind::scale, "motor_torque", 0, 0, 1,
         seen + "another machine, or units other than " + (declared.linear ? "N and m" : "N m and rad"),
         Consequence::noted});
}

/// How much of a column differs between passes in opposite directions through the same place, of its
/// variance; 1 where they hardly meet.
double between_directions(const std::vector<double>& column, const std::vector<double>& speed,
                          const std::vector<std::size_t>& by_place) {
  double squares = 0, meetings = 0;
  for (std::size_t k = 0; k + 1 < by_place.size(); ++k) {
    const std::size_t i = by_place[k], j = by_place[k + 1];
    if (!(speed[i] * speed[j] < 0)) continue;
    squares += 0.5 * std::pow(column[i] - column[j], 2);
    meetings += 1;
  }
  const double variance = varying(column).squaredNorm() / double(column.size());
  return meetings < kFewestMeetings || !(variance > 0) ? 1 : squares / meetings / variance;
}

void look_at_model_torque(const DrivenMotion& m, const Driven& d, std::vector<Finding>& found) {
  std::vector<std::size_t> by_place(m.motor.size());
  for (std::size_t i = 0; i < by_place.size(); ++i) by_place[i] = i;
  std::sort(by_place.begin(), by_place.end(),
            [&](std::size_t i, std::size_t j) { return m.motor[i] < m.motor[j]; });
  // A motion whose acceleration is a function of the place, as one sine, shows nothing. In the band: noise of
  // the torque is no friction.
  if (between_directions(d.acceleration, d.speed, by_place) < kExplainsNot ||
      between_directions(d.torque, d.speed, by_place) > kOfPosition * kOfPosition)
    return;
  refuse(found, FindingKind::dead, "motor_torque",
         "motor_torque is a function of motor_position alone, the same in both directions of motion: the "
         "output of a "
         "model, not the torque that the motor applied; record the measured torque or current");
}

void look_at_rate(const DrivenMotion& m, const DeclaredMotion& declared, std::vector<Finding>& found) {
  if (!declared.resonance) return;
  const double swings = declared.resonance(root_mean_square(m.torque)) * m.interval;
  if (swings > kMostSwings)
    refuse(found, FindingKind::scale, "time",
           fmt::format("has samples every {:.4g} s, in which motor and load of the rig file swing "
                       "against each other {:.4g} times: time is not in seconds, or far too few "
                       "samples were taken",
                       m.interval, swings));
}

}  // namespace

std::vector<Finding> sense_of(const DrivenMotion& motion, const DeclaredMotion& declared) {
  std::vector<Finding> found;
  if (!declared.free_load || motion.motor.size() < kFewest || motion.torque.size() != motion.motor.size())
    return found;
  const bool two = declared.through_teeth && motion.load.size() == motion.motor.size();
  if (declared.through_teeth) look_at_rate(motion, declared, found);
  if (two) look_at_travel(motion, declared, found);
  if (found.empty() && two && load_moves(motion)) look_at_lag(motion, found);
  const Driven d = driven(motion.torque, motion.motor, motion.interval);
  look_at_torque(motion, d, declared.linear, found);
  if (found.empty()) look_at_model_torque(motion, d, found);
  if (found.empty()) look_at_inertia(motion, d, declared, found);
  return found;
}

}  // namespace backlash::record
