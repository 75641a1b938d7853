// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/encoder_skew.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/blocks.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::record {
namespace {

constexpr double kWidestBand = 0.2;  // theory: of the sampling rate, up to which differences are derivatives
constexpr double kBand = 20;         // Hz, simulation: most of a motion, below most mesh resonances
constexpr double kEnds = 3;          // theory: periods of the cutoff at either end, where the filter settles
constexpr double kOversampling = 1.25;  // theory: rows per second over those of a signal of this bandwidth
constexpr double kKnee = 0.05;          // choice: of the rms torque, where it changes the flank
constexpr double kStands = 0.02;        // choice: of the rms speed, below which friction has no sign
constexpr int kIterations = 20;         // choice: of the weights of least absolute deviations
constexpr double kSmallest = 0.01;      // choice: of the mean deviation: what is smaller counts alike
constexpr std::size_t kBlocks = 12;     // choice
constexpr double kFriction = 0.06;  // of the torque, that yields teeth in proportion to the speed: simulation
constexpr double kClear = 4;        // choice: standard errors
constexpr std::size_t kFewest = 64;                 // samples, choice
constexpr Eigen::Index kSkew = 2, kCompliance = 3;  // their columns
constexpr Eigen::Index kColumns = 7;

double rms(const std::vector<double>& x) {
  double square = 0;
  for (const double v : x) square += v * v;
  return std::sqrt(square / double(std::max<std::size_t>(1, x.size())));
}

struct Rows {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  double torque_per_speed = 0;  // N m s/rad, of rms values
};

Rows rows_of(const DrivenPositions& p, double cutoff) {
  const auto smooth = [&](const std::vector<double>& x) { return signal::low_pass(x, p.interval, cutoff); };
  const std::vector<double> motor = smooth(p.motor), load = smooth(p.load);
  std::vector<double> torque = smooth(p.torque);
  const std::vector<double> speed = signal::derivative(load, p.interval),
                            acceleration =
                                signal::derivative(signal::derivative(motor, p.interval), p.interval);
  for (std::size_t k = 0; k < torque.size(); ++k) torque[k] -= p.motor_inertia * acceleration[k];
  const double knee = std::max(kKnee * rms(torque), 1e-300), stands = kStands * rms(speed);
  const auto ends = std::size_t(std::lround(kEnds / (cutoff * p.interval)));
  const auto stride = std::size_t(std::max(1L, std::lround(1 / (2 * kOversampling * cutoff * p.interval))));
  const std::size_t n = motor.size();
  const std::size_t count = n > 2 * ends ? (n - 2 * ends + stride - 1) / stride : 0;
  if (count < 4 * std::size_t(kColumns))
    throw CannotIdentify("too short to estimate the skew of the encoders");
  Rows rows{Eigen::MatrixXd(Eigen::Index(count), kColumns), Eigen::VectorXd(Eigen::Index(count)),
            rms(torque) / std::max(rms(speed), 1e-300)};
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = ends + i * stride;
    const double sign = std::fabs(speed[k]) <= stands ? 0 : speed[k] > 0 ? 1 : -1;
    rows.a.row(Eigen::Index(i)) << 1, load[k], speed[k], torque[k], std::tanh(torque[k] / knee), sign,
        acceleration[k];
    rows.b[Eigen::Index(i)] = motor[k] - load[k];
  }
  return rows;
}

/// Least absolute deviations by weights; standard error from blocks left out.
signal::Measured skew_in_band(const DrivenPositions& p, double cutoff) {
  const Rows rows = rows_of(p, cutoff);
  const Eigen::Index n = rows.b.size();
  Eigen::VectorXd root = Eigen::VectorXd::Ones(n), x;
  for (int i = 0; i < kIterations; ++i) {
    x = signal::fit_linear(root.asDiagonal() * rows.a, root.asDiagonal() * rows.b).values;
    const Eigen::VectorXd away = (rows.b - rows.a * x).cwiseAbs();
    const double least = kSmallest * away.mean();
    if (!(least > 0)) break;
    root = away.cwiseMax(least).cwiseSqrt().cwiseInverse();
    root /= root.mean();
  }
  std::vector<std::size_t> block(static_cast<std::size_t>(n));
  for (std::size_t i = 0; i < block.size(); ++i) block[i] = kBlocks * i / block.size();
  const Eigen::MatrixXd covariance = signal::jackknife_covariance(
      root.asDiagonal() * rows.a, root.asDiagonal() * (rows.b - rows.a * x), block);
  // Friction of the motor that is not as modelled is a torque that never reaches the teeth.
  const double friction = kFriction * std::fabs(x[kCompliance]) * rows.torque_per_speed;
  return {x[kSkew], std::hypot(std::sqrt(covariance(kSkew, kSkew)), friction)};
}

}  // namespace

signal::Measured encoder_skew(const DrivenPositions& positions) {
  const std::size_t n = positions.motor.size();
  if (n < kFewest || positions.torque.size() != n || positions.load.size() != n)
    throw CannotIdentify("too short, or without a column, to estimate the skew of the encoders");
  const double cutoff = std::min(kBand, kWidestBand / positions.interval);
  signal::Measured skew = skew_in_band(positions, cutoff);
  const double slow = skew_in_band(positions, 0.5 * cutoff).value;
  skew.standard_error = std::hypot(skew.standard_error, skew.value - slow);
  return skew;
}

bool is_clear(const signal::Measured& skew) {
  return std::fabs(skew.value) > kClear * skew.standard_error;
}

Record without_encoder_skew(Record record, double skew) {
  if (skew == 0) return record;
  const double samples = skew / record.sampling_interval();
  for (const Channel channel : {Channel::load_position, Channel::load_velocity})
    if (record.has(channel)) record.column(channel) = signal::delayed(record.column(channel), -samples);
  return record;
}

}  // namespace backlash::record
