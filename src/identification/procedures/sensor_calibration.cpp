// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/sensor_calibration.h"

#include <fmt/core.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/blocks.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr double kMoving = 0.1;       // choice: of the largest speed: slower does not count as moving one way
constexpr double kLeastSpread = 0.1;  // choice: of the largest speed
constexpr std::size_t kParts = 10;    // choice: blocks of rows of one run that are left out one at a time

/// Means of two channels while the motor turns one way.
struct OneWayRun {
  double sign;
  std::vector<double> motor, load;
};

void require(const CalibrationOptions& options) {
  if (!(options.block > 0)) throw InvalidParameter("block", options.block, "must be > 0 s");
  if (!(options.settle >= 0)) throw InvalidParameter("settle", options.settle, "must be >= 0 s");
}

/// Cuts the record where its motor slows down or reverses; runs of fewer than `least` blocks are left out.
std::vector<OneWayRun> one_way_runs(const record::Record& recorded, record::Channel motor,
                                    record::Channel load, const CalibrationOptions& options,
                                    std::size_t least) {
  for (const record::Channel channel : {motor, load})
    if (!recorded.has(channel))
      throw CannotIdentify(recorded.name + ": calibration needs " + record::channel_name(channel));
  const record::Record record = record::evenly_sampled(recorded);
  const double interval = record.sampling_interval();
  const auto length = std::max<std::size_t>(1, std::lround(options.block / interval));
  const auto settle = static_cast<std::size_t>(std::ceil(options.settle / (double(length) * interval)));
  const std::vector<double> m = signal::block_means(record.column(motor), length),
                            l = signal::block_means(record.column(load), length);
  const bool is_speed = motor == record::Channel::motor_velocity;
  const std::vector<double> speed =
      is_speed ? m : signal::block_means(signal::derivative(record.column(motor), interval), length);
  double largest = 0;
  for (const double v : speed) largest = std::max(largest, std::fabs(v));
  const auto direction = [&](std::size_t k) {
    return std::fabs(speed[k]) <= kMoving * largest ? 0 : speed[k] > 0 ? 1 : -1;
  };
  std::vector<OneWayRun> runs;
  for (std::size_t k = 0, end; k < speed.size(); k = end) {
    for (end = k + 1; end < speed.size() && direction(end) == direction(k);) ++end;
    if (direction(k) == 0 || end - k < 2 * settle + least) continue;
    runs.push_back({double(direction(k)),
                    {m.begin() + k + settle, m.begin() + end - settle},
                    {l.begin() + k + settle, l.begin() + end - settle}});
  }
  return runs;
}

/// Rows of all runs: motor minus its mean, and one column of ones per `column` that a run belongs to.
struct Equations {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  std::vector<std::size_t> block;
  double centre = 0, least = 0, most = 0;
};

Equations equations(const std::vector<OneWayRun>& runs, bool by_direction) {
  std::size_t rows = 0;
  Equations e;
  e.least = e.most = runs.front().motor.front();
  for (const auto& run : runs) rows += run.motor.size();
  for (const auto& run : runs)
    for (const double x : run.motor) {
      e.centre += x / double(rows);
      e.least = std::min(e.least, x);
      e.most = std::max(e.most, x);
    }
  e.a = Eigen::MatrixXd::Zero(rows, by_direction ? 3 : 2);
  e.b.resize(rows);
  std::size_t row = 0, first_block = 0;
  for (const auto& run : runs) {
    const std::size_t n = run.motor.size(), parts = std::min(kParts, n);
    for (std::size_t k = 0; k < n; ++k, ++row) {
      e.a(row, 0) = run.motor[k] - e.centre;
      e.a(row, by_direction && run.sign < 0 ? 2 : 1) = 1;
      e.b[row] = run.load[k];
      e.block.push_back(first_block + k * parts / n);
    }
    first_block += parts;
  }
  return e;
}

/// Value and error of a weighted sum of the unknowns.
signal::Measured combination(const signal::LeastSquaresFit& fit, const Eigen::VectorXd& weight) {
  return {weight.dot(fit.values), std::sqrt(weight.dot(fit.covariance * weight))};
}

signal::LeastSquaresFit solve(const Equations& e) {
  signal::LeastSquaresFit fit = signal::fit_linear(e.a, e.b);
  fit.covariance = signal::jackknife_covariance(e.a, fit.residuals, e.block);
  return fit;
}

std::vector<std::string> cut_warning(std::size_t runs, const std::string& name) {
  if (runs < 2) return {};
  return {name + ": cut into " + std::to_string(runs) + " runs one way"};
}

}  // namespace

SpeedCalibration calibrate_speed(const record::Record& record, const CalibrationOptions& options) {
  require(options);
  const auto runs =
      one_way_runs(record, record::Channel::motor_velocity, record::Channel::load_velocity, options, 8);
  if (runs.empty()) throw CannotIdentify(record.name + ": the motor does not turn one way for long enough");
  const Equations e = equations(runs, false);
  const double largest = std::max(std::fabs(e.least), std::fabs(e.most));
  if (e.most - e.least < kLeastSpread * largest)
    throw CannotIdentify(
        fmt::format("{}: speeds from {:.3g} to {:.3g} rad/s only: scale and offset cannot be distinguished: "
                    "run at further speeds",
                    record.name, e.least, e.most));
  const signal::LeastSquaresFit fit = solve(e);
  return {fit.parameter(0), combination(fit, Eigen::Vector2d(-e.centre, 1)),
          cut_warning(runs.size(), record.name)};
}

PositionCalibration calibrate_position(const std::vector<record::Record>& records,
                                       const CalibrationOptions& options) {
  require(options);
  std::vector<OneWayRun> runs;
  PositionCalibration out;
  for (const record::Record& record : records) {
    const auto more = one_way_runs(record, record::Channel::motor_position, record::Channel::load_position,
                                   options, kParts);
    for (const auto& warning : cut_warning(more.size(), record.name)) out.warnings.push_back(warning);
    runs.insert(runs.end(), more.begin(), more.end());
  }
  if (runs.empty())
    throw CannotIdentify("position calibration: the motor does not turn one way for long enough");
  const auto forward = [](const OneWayRun& run) { return run.sign > 0; };
  const bool both =
      std::any_of(runs.begin(), runs.end(), forward) && !std::all_of(runs.begin(), runs.end(), forward);
  const Equations e = equations(runs, both);
  const signal::LeastSquaresFit fit = solve(e);
  out.scale = fit.parameter(0);
  out.travel = e.most - e.least;
  if (both) {
    out.offset = combination(fit, Eigen::Vector3d(-e.centre, 0.5, 0.5));
    out.play_and_wind_up = combination(fit, Eigen::Vector3d(0, -1, 1));
  } else {
    out.offset = combination(fit, Eigen::Vector2d(-e.centre, 1));
    out.warnings.emplace_back("one direction only: the offset holds half of play and wind-up");
  }
  return out;
}

}  // namespace backlash::identification
