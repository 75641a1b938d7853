// SPDX-License-Identifier: BSD-3-Clause
#include "record_sense.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/fit/mesh_resonance.h"
#include "backlash_diagnosis/model/axis_unit.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "backlash_diagnosis/simulation/driven_load.h"

namespace backlash::identification {
namespace {

constexpr double kFollows = 0.9;                             // choice: correlation of a load that moves along
constexpr double kLeastTravel = 0.8, kLargestTravel = 1.25;  // choice: gaps and deflections are far smaller
constexpr double kStandsStill = 0.05;                        // choice: of the travel of the other
constexpr double kLooser = 20;  // choice: a play or compliance so many times the declared is not believed
constexpr double kBand = 20, kWidestBand = 0.1;  // Hz, of the sampling rate: choice
constexpr double kStands = 0.05;                 // choice: of the rms speed, below which friction has no sign
// Shares of the torque that inertia and friction must be spent on for their signs to count. Late torques turn
// the sign of one of them, springs and gravity that of the other, none that of both.
constexpr double kInertiaShare = 0.1, kFrictionShare = 0.03;
constexpr double kMostSwings = 10;   // choice: of motor against load, between two samples
constexpr double kClearShare = 0.3;  // choice: of the torque, that an inertia must take to be told
constexpr double kHeavier = 10;      // choice: rig files are right within 40 %
constexpr std::size_t kFewest = 64;

Eigen::VectorXd varying(const std::vector<double>& x) {
  const Eigen::Map<const Eigen::VectorXd> v(x.data(), Eigen::Index(x.size()));
  return v.array() - v.mean();
}

/// rad: difference of the travels that the declared play and teeth allow.
double looseness(const RecordedMotion& m, const model::Rig& rig) {
  const auto [least, most] = std::minmax_element(m.torque.begin(), m.torque.end());
  const double lever = rig.mesh.lever(), force = std::max(-*least, *most) / lever;
  const double yields = force > 0 ? rig.mesh.contact->static_penetration(force) : 0;
  return (rig.mesh.backlash + 2 * yields) / lever;
}

void require_same_travel(const RecordedMotion& m, const model::Rig& rig) {
  const Eigen::VectorXd motor = varying(m.motor), load = varying(m.load);
  const double along = motor.dot(load), size = motor.norm() * load.norm();
  if (!(size > 0) || std::abs(along) < kFollows * size) return;
  const double times = std::copysign(load.norm() / motor.norm(), along);
  const double apart = std::abs(times - 1) * signal::peak_to_peak(m.motor);
  if (apart < kLooser * looseness(m, rig)) return;  // as of a motor that is held while the load is moved
  if (times < 0)
    throw BadData(m.record,
                  fmt::format("load_position turns against motor_position, {:.4g} times as far: the sign "
                              "of one of them is not that of the rig file",
                              -times));
  if (times < kLeastTravel || times > kLargestTravel)
    throw BadData(m.record,
                  fmt::format("load_position travels {:.4g} times as far as motor_position, both seen from "
                              "the load: units, reduction_ratio or motor_side are not those of the record",
                              times));
}

/// What the torque is spent on: inertia, and shares of it and of friction in the torque.
struct Spent {
  double inertia = 0, inertia_share = 0, friction_share = 0;
};

/// All 0 of a motion that does not tell them apart.
Spent spent(const RecordedMotion& m) {
  const auto smooth = [&](const std::vector<double>& x) {
    return signal::low_pass(x, m.interval, std::min(kBand, kWidestBand / m.interval));
  };
  const std::vector<double> torque = smooth(m.torque),
                            speed = signal::derivative(smooth(m.motor), m.interval),
                            acceleration = signal::derivative(speed, m.interval);
  const auto n = Eigen::Index(torque.size());
  const double stands = kStands * varying(speed).norm() / std::sqrt(double(n)), size = varying(torque).norm();
  Eigen::MatrixXd a(n, 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double w = speed[std::size_t(i)];
    a.row(i) << acceleration[std::size_t(i)], w, std::abs(w) <= stands ? 0 : std::copysign(1, w), 1;
  }
  if (!(size > 0)) return {};
  try {
    const Eigen::VectorXd b = Eigen::Map<const Eigen::VectorXd>(torque.data(), n),
                          x = signal::fit_linear(a, b).values;
    const Eigen::VectorXd friction = a.middleCols(1, 2) * x.segment(1, 2);
    return {x[0], x[0] * a.col(0).norm() / size, friction.dot(a.col(1)) / (a.col(1).norm() * size)};
  } catch (const CannotIdentify&) {
    return {};
  }
}

void require_driving_torque(const RecordedMotion& m, bool linear) {
  const Spent on = spent(m);
  if (on.inertia_share < -kInertiaShare && on.friction_share < -kFrictionShare)
    throw BadData(m.record,
                  fmt::format("motor_torque works against the motion, as if the machine had an inertia of "
                              "{:.4g} {} and friction that drives: the sign of motor_torque or of "
                              "motor_position is not that of the rig file",
                              on.inertia, model::axis_unit("kg m^2", linear)));
}

void require_rate(const RecordedMotion& m, const model::Rig& rig) {
  const double swings = mesh_resonance(rig, usual_torque(m.torque)) * m.interval;
  if (swings > kMostSwings)
    throw BadData(m.record,
                  fmt::format("has samples every {:.4g} s, in which motor and load of the rig file swing "
                              "against each other {:.4g} times: time is not in seconds, or far too few "
                              "samples were taken",
                              m.interval, swings));
}

bool load_moves(const RecordedMotion& m) {
  return !m.load.empty() && signal::peak_to_peak(m.load) > kStandsStill * signal::peak_to_peak(m.motor);
}

bool is_asked(const RecordedMotion& motion, const model::Rig& rig) {
  return (simulation::load_moves_freely(rig) || rig.mesh.rigid) && motion.motor.size() >= kFewest &&
         motion.torque.size() == motion.motor.size();
}

}  // namespace

void require_sense(const RecordedMotion& motion, const model::Rig& rig) {
  if (!is_asked(motion, rig)) return;
  const bool two = simulation::load_moves_freely(rig);
  if (two) require_rate(motion, rig);
  if (two && motion.load.size() == motion.motor.size()) require_same_travel(motion, rig);
  require_driving_torque(motion, rig.linear);
}

std::vector<std::string> unit_warnings(const RecordedMotion& motion, const model::Rig& rig) {
  if (!is_asked(motion, rig)) return {};
  const Spent on = spent(motion);
  const bool alone = rig.mesh.rigid || !load_moves(motion);  // as of the driver by itself
  const double times = on.inertia / (rig.motor.inertia + (alone ? 0 : rig.link.inertia));
  if (on.inertia_share < kClearShare || (times <= kHeavier && times >= 1 / kHeavier)) return {};
  return {
      fmt::format("{}: {} is {:.3g} times what the rig file says: another machine, or units other than {}",
                  motion.record, rig.linear ? "the mass that moves" : "the inertia that its torque moves",
                  times, rig.linear ? "N and m" : "N m and rad")};
}

}  // namespace backlash::identification
