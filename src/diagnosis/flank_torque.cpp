// SPDX-License-Identifier: BSD-3-Clause
#include "flank_torque.h"

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "prior_regression.h"

namespace backlash::diagnosis {
namespace {

using Eigen::VectorXd;

// Relative standard deviations of what rig files say of friction and of weights over the load's inertia,
// choice: machines of test/campaigns are up to 40 % off in any of them.
constexpr double kFriction = 0.6, kTerms = 0.3;
constexpr double kMotorInertia = 0.5;  // of a locked output, where it takes hardly any torque
constexpr double kOffset = 0.03;       // of the level, of a torque sensor or a current: choice
constexpr double kSlow = 0.02;         // of the rms speed, below which dry friction fades
constexpr double kStill = 0.04;        // the same, below which it may take any value
constexpr double kLarge = 0.95;        // quantile
// Torque that no declared term explains: standard errors, and share of the level, from which it counts.
// Choices.
constexpr double kShownErrors = 4, kShownShare = 0.05;
constexpr int kShownSteps = 10;
constexpr double kBlock = 32;  // windows, that count as one: choice

double rms(const std::vector<double>& x) {
  double squares = 0;
  for (const double v : x) squares += v * v;
  return std::sqrt(squares / double(std::max<std::size_t>(1, x.size())));
}

double position_noise(const std::vector<double>& q) {
  return std::max(signal::noise_from_differences(q, 4), signal::smallest_step(q) / std::sqrt(12.0));
}

/// Of the mean of the second differences.
double acceleration_noise(const TwoEncoders& motion, const std::vector<double>& q, std::size_t half) {
  return std::sqrt(6.0) * position_noise(q) / std::pow(double(half) * motion.interval, 2);
}

double level_of(const VectorXd& torque) {
  std::vector<double> size(torque.data(), torque.data() + torque.size());
  for (double& t : size) t = std::abs(t);
  return size.empty() ? 0 : signal::quantile(std::move(size), kLarge);
}

VectorXd direction_of(const std::vector<double>& speed, double fades) {
  VectorXd sign(Eigen::Index(speed.size()));
  for (std::size_t i = 0; i < speed.size(); ++i)
    sign[Eigen::Index(i)] = std::clamp(speed[i] / std::max(fades, 1e-300), -1.0, 1.0);
  return sign;
}

/// A weight that no term declares is seen in the motor's torque: of
///   tau - declared terms = J_M a_M + J_L a_L + d w_M + C sign(w_M) + offset + g sin(q) + h cos(q)
/// the last two, zeros where they are not clear.
VectorXd undeclared_load(const FlankWindows& w, const VectorXd& declared,
                         const PositionDifferenceSettings& s) {
  const auto n = Eigen::Index(w.size());
  const double moves = rms(w.speed);
  const VectorXd sign = direction_of(w.speed, kSlow * moves),
                 torque = Eigen::Map<const VectorXd>(w.torque.data(), n) - declared;
  const double level = level_of(torque);
  PriorRegression fit;
  fit.mean = VectorXd::Zero(7), fit.deviation = VectorXd::Constant(7, level);
  fit.mean.head(2) << s.motor_inertia, s.load_inertia;
  fit.deviation.head(5) << kMotorInertia * s.motor_inertia + 1e-12, kMotorInertia * s.load_inertia + 1e-12,
      INFINITY, INFINITY, kOffset * level;
  std::vector<Eigen::Index> at;
  for (Eigen::Index i = 0; i < n; ++i)
    if (std::abs(w.speed[std::size_t(i)]) > kStill * moves) at.push_back(i);
  fit.groups = std::max<std::size_t>(8, std::size_t(double(at.size()) / kBlock));
  for (std::size_t k = 0; k < at.size(); ++k) {
    const auto i = std::size_t(at[k]);
    PriorRegression::Row row;
    row.y = torque[at[k]], row.group = k * fit.groups / at.size();
    const double columns[] = {w.acceleration[i],    w.load_acceleration[i], w.speed[i], sign[at[k]], 1,
                              std::sin(w.motor[i]), std::cos(w.motor[i])};
    for (Eigen::Index c = 0; c < 7; ++c) row.add(c, columns[c]);
    fit.rows.push_back(row);
  }
  VectorXd shown = VectorXd::Zero(n);
  if (at.size() < 16) return shown;
  for (int k = 0; k < kShownSteps; ++k) fit.step();
  double variance = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double q = w.motor[std::size_t(i)];
    shown[i] = fit.x[5] * std::sin(q) + fit.x[6] * std::cos(q);
  }
  // its error where the path begins, ends and is halved: it is a smooth function of the position
  const auto [low, high] = signal::extent(w.motor);
  for (const double q : {low, 0.5 * (low + high), high}) {
    VectorXd of = VectorXd::Zero(7);
    of[5] = std::sin(q), of[6] = std::cos(q);
    variance += fit.variance(of) / 3;
  }
  const double size = shown.norm() / std::sqrt(double(n));
  if (size < kShownErrors * std::sqrt(variance) || size < kShownShare * level) shown.setZero();
  return shown;
}

FlankTorque by_load(const TwoEncoders& motion, const FlankWindows& w, const PositionDifferenceSettings& s) {
  FlankTorque out;
  const auto n = Eigen::Index(w.size());
  VectorXd terms = VectorXd::Zero(n);
  if (s.load_torque)
    for (Eigen::Index i = 0; i < n; ++i) terms[i] = s.load_torque(w.motor[std::size_t(i)]);
  if (n > 0 && terms.isZero())
    terms = undeclared_load(w, terms, s), out.shown = terms.norm() / std::sqrt(double(n));
  const VectorXd inertial = s.load_inertia * Eigen::Map<const VectorXd>(w.load_acceleration.data(), n),
                 direction = direction_of(w.load_speed, kSlow * rms(w.speed)),
                 friction = s.load_friction * direction;
  out.torque =
      inertial + friction + terms + s.load_damping * Eigen::Map<const VectorXd>(w.load_speed.data(), n);
  out.unsure.resize(n, 2);
  out.unsure << kFriction * friction, kTerms * terms;
  out.still = (1 + kFriction) * s.load_friction * (1 - direction.array().abs());
  out.noise = s.load_inertia * acceleration_noise(motion, motion.load, w.half);
  return out;
}

}  // namespace

FlankTorque flank_torque(const TwoEncoders& motion, const FlankWindows& w, TorqueBy by,
                         const PositionDifferenceSettings& s) {
  FlankTorque out;
  const auto n = Eigen::Index(w.size());
  if (by == TorqueBy::load) {
    out = by_load(motion, w, s);
    out.level = level_of(out.torque);
    return out;
  }
  out.torque = Eigen::Map<const VectorXd>(w.torque.data(), n);
  out.still = VectorXd::Zero(n);
  // white noise of samples, averaged by the triangle
  out.noise = signal::noise_from_differences(motion.torque, 2) * std::sqrt(2 / (3 * double(w.half)));
  if (by == TorqueBy::sensor) {
    out.level = level_of(out.torque);
    out.unsure.resize(n, 2);
    out.unsure << kFriction * s.load_friction * direction_of(w.load_speed, kSlow * rms(w.speed)),
        VectorXd::Constant(n, kOffset * out.level);
    return out;
  }
  const VectorXd inertial = s.motor_inertia * Eigen::Map<const VectorXd>(w.acceleration.data(), n);
  out.torque -= inertial;
  out.level = level_of(out.torque);
  out.unsure = kMotorInertia * inertial;
  out.noise = std::hypot(out.noise, s.motor_inertia * acceleration_noise(motion, motion.motor, w.half));
  return out;
}

}  // namespace backlash::diagnosis
