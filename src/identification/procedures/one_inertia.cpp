// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/one_inertia.h"

#include <fmt/core.h>

#include <Eigen/Core>
#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <limits>

#include "../fit/missing_effects.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/blocks.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/weighted_mean.h"
#include "backlash_diagnosis/signal/zero_phase.h"
#include "one_inertia_signals.h"

namespace backlash::identification {
namespace {

using Signals = OneInertiaSignals;

constexpr double kLargestDelay = 2;  // choice: sampling intervals, ...
constexpr double kDelayPeriods =
    0.2;  // choice: ... or of a period of the cutoff, where inertia and drag look alike at a quarter
constexpr int kDelayBits = 12;          // choice: the search ends within 0.001 of an interval
constexpr double kVagueDelay = 1;       // choice: sampling intervals of standard error
constexpr double kSmoothed = 2;         // choice: times that lower cutoff, to which its columns are smoothed
constexpr double kAnother = 2;          // theory: standard errors, 95 %
constexpr double kSurer = 0.5;          // choice: times the error of the whole band
constexpr double kLeastShare = 0.05;    // choice: of the samples in each direction
constexpr std::size_t kBlocks = 30;     // choice: left out one at a time, for the errors
constexpr double kUnsureOfNoise = 0.3;  // choice: of what noise of the acceleration makes of the inertia
constexpr double kMuchLeft = 0.1;       // choice: relative error that is worth a warning

Eigen::VectorXd picked(const std::vector<double>& values, const std::vector<Eigen::Index>& rows) {
  Eigen::VectorXd out(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) out[i] = values[rows[i]];
  return out;
}

Eigen::MatrixXd picked(const Eigen::MatrixXd& columns, const std::vector<Eigen::Index>& rows) {
  Eigen::MatrixXd out(rows.size(), columns.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) out.row(i) = columns.row(rows[i]);
  return out;
}

void require_both_directions(const std::string& name, const Signals& s) {
  double forward = 0, backward = 0;
  for (const auto k : s.used) (s.columns(k, 1) > 0 ? forward : backward) += 1;
  if (s.used.size() < 64 || std::min(forward, backward) < kLeastShare * double(s.time.size()))
    throw CannotIdentify(fmt::format(
        "{}: moves for certain, beyond the noise of its speed, forward in {:.3g} % and backward in "
        "{:.3g} % of the samples: Coulomb friction and offset cannot be distinguished: move both ways",
        name, 100 * forward / double(s.time.size()), 100 * backward / double(s.time.size())));
}

/// Samples, to either side.
double largest_delay(const Signals& s) {
  return std::max(kLargestDelay, kDelayPeriods / (s.cutoff * s.interval));
}

/// Delay [samples] with the smallest residual.
double best_delay(const Signals& s, const Eigen::MatrixXd& a) {
  const Eigen::MatrixXd q = signal::orthonormal_basis(a);
  const auto left = [&](double delay) {
    const Eigen::VectorXd b = picked(low_pass_sliding(s, signal::delayed(s.torque, delay)), s.used);
    return (b - q * (q.transpose() * b)).squaredNorm();
  };
  const double largest = largest_delay(s);
  return boost::math::tools::brent_find_minima(left, -largest, largest, kDelayBits).first;
}

/// The delay is one more column: what the torque would gain by one sample of it.
Eigen::MatrixXd with_delay_column(const Signals& s, const Eigen::MatrixXd& a, double delay) {
  Eigen::MatrixXd all(a.rows(), a.cols() + 1);
  all << a, picked(low_pass_sliding(s, signal::derivative(signal::delayed(s.torque, delay), 1)), s.used);
  return all;
}

std::vector<std::size_t> block_of_rows(const Signals& s) {
  std::vector<std::size_t> block;
  for (std::size_t i = 0; i < s.used.size(); ++i) block.push_back(i * kBlocks / s.used.size());
  return block;
}

/// Parameters at one delay, errors of the parameters and, where it is one of them, of the delay [samples].
struct Solution {
  double delay = 0;
  signal::LeastSquaresFit fit;
  Eigen::VectorXd error;
};

/// White noise of the position, differentiated twice up to the cutoff: the square of the gain (2 pi f)^2
/// integrated.
double acceleration_noise(const Signals& s, double position_noise) {
  return position_noise * std::pow(2 * M_PI * s.cutoff, 2) * std::sqrt(2 * s.cutoff * s.interval / 5);
}

/// Fitted minus true values that the noise of the acceleration makes, which is known and not correlated with
/// the torque: (A'A - rows noise^2 e e')^-1 A'b are the true ones (Fuller 1987, Measurement Error Models,
/// Section 2.2).
Eigen::VectorXd noise_bias(const Signals& s, const Eigen::MatrixXd& a, const signal::LeastSquaresFit& fit) {
  const Eigen::VectorXd unit = a.colwise().norm().cwiseInverse();
  Eigen::MatrixXd normal = signal::gram(Eigen::MatrixXd(a * unit.asDiagonal()));
  const double noise = double(a.rows()) * std::pow(acceleration_noise(s, s.position_error) * unit[0], 2);
  normal(0, 0) -= noise;
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(a.cols());
  gradient[0] = -noise * fit.values[0] / unit[0];
  return unit.cwiseProduct(signal::solve_symmetric(normal, gradient));
}

Solution solve(const Signals& s, const Eigen::MatrixXd& a, double delay, bool estimated) {
  Solution out;
  out.delay = delay;
  out.fit = signal::fit_linear(a, picked(low_pass_sliding(s, signal::delayed(s.torque, delay)), s.used));
  const Eigen::MatrixXd all = estimated ? with_delay_column(s, a, delay) : a;
  out.error = signal::jackknife_covariance(all, out.fit.residuals, block_of_rows(s)).diagonal().cwiseSqrt();
  out.error *=
      signal::student_t_quantile(0.975, double(kBlocks) - double(all.cols())) / signal::kNormalQuantile975;
  const Eigen::VectorXd bias = noise_bias(s, a, out.fit);
  out.fit.values -= bias;
  out.fit.residuals += a * bias;
  for (Eigen::Index i = 0; i < bias.size(); ++i)
    out.error[i] = std::hypot(out.error[i], kUnsureOfNoise * bias[i]);
  return out;
}

/// Relative error that noise alone would leave.
double floor_of(const record::Record& record, const Signals& s, double inertia, double torque_size) {
  const double left = signal::noise_after_low_pass(s.interval, s.cutoff);
  const double torque = signal::white_noise(record.column(record::Channel::motor_torque)) * left;
  return std::hypot(torque, inertia * acceleration_noise(s, s.position_noise)) / torque_size;
}

/// All samples. Friction builds up since the last reversal.
std::vector<model::JointMoment> moments_of(const record::Record& record, const Signals& s) {
  const std::vector<double>& position = record.column(record::Channel::motor_position);
  const std::vector<double> speed = signal::derivative(position, s.interval);
  std::vector<model::JointMoment> all(position.size());
  double way = std::numeric_limits<double>::infinity(), before = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    way = speed[k] * before < 0 ? 0 : way + std::fabs(speed[k]) * s.interval;
    if (speed[k] != 0) before = speed[k];
    const double direction = (speed[k] > 0) - (speed[k] < 0);
    all[k] = {record.time[k] - record.time.front(), position[k], speed[k], direction, s.torque[k], way};
  }
  return all;
}

/// Where more is left than noise leaves, an effect that the equation lacks may have drawn the parameters.
void allow_for_missing(Solution& solution, const Signals& s, const Eigen::MatrixXd& a,
                       const record::Record& record, double noise) {
  std::vector<Eigen::MatrixXd> effects;
  for (const EffectShapes& effect : likely_effects(moments_of(record, s))) {
    Eigen::MatrixXd columns(a.rows(), Eigen::Index(effect.shapes.size()));
    for (std::size_t i = 0; i < effect.shapes.size(); ++i)
      columns.col(Eigen::Index(i)) = picked(low_pass_sliding(s, effect.shapes[i]), s.used);
    effects.push_back(std::move(columns));
  }
  const Eigen::VectorXd drawn = drawn_by_missing(a, solution.fit.residuals, effects, noise);
  for (Eigen::Index i = 0; i < drawn.size(); ++i) solution.error[i] = std::hypot(solution.error[i], drawn[i]);
}

/// In the order of the columns.
std::vector<signal::Measured OneInertia::*> fitted_members(bool gravity) {
  std::vector<signal::Measured OneInertia::*> all = {&OneInertia::inertia, &OneInertia::viscous,
                                                     &OneInertia::coulomb, &OneInertia::offset};
  if (gravity) all.insert(all.end(), {&OneInertia::gravity_sine, &OneInertia::gravity_cosine});
  return all;
}

double spread(const Eigen::VectorXd& values) {
  return std::sqrt((values.array() - values.mean()).square().mean());
}

}  // namespace

namespace {

/// The machine in one band, with its errors by noise.
struct Read {
  Signals signals;
  double smoothed = 0;  // Hz
  Eigen::MatrixXd columns;
  Solution solution;
  signal::Measured delay;  // s
  std::vector<std::string> warnings;
};

Read read_band(const record::EvenGrid& grid, double cutoff, const OneInertiaOptions& options,
               double smoothed) {
  Read read{one_inertia_signals(grid, cutoff, options.gravity, smoothed), smoothed, {}, {}, {}, {}};
  const Signals& s = read.signals;
  require_both_directions(grid.record.name, s);
  if (options.delay && !(std::fabs(*options.delay) <= kLargestDelay * s.interval))
    throw InvalidParameter("delay", *options.delay, "must be within two sampling intervals");
  const Eigen::MatrixXd& a = read.columns = picked(s.columns, s.used);
  if (options.delay) {
    read.solution = solve(s, a, *options.delay / s.interval, false);
    read.delay = {*options.delay, 0};
    return read;
  }
  read.solution = solve(s, a, best_delay(s, a), true);
  const double error = read.solution.error[a.cols()], largest = largest_delay(s);
  read.delay = {read.solution.delay * s.interval, error * s.interval};
  if (std::fabs(read.solution.delay) <= largest - 0.01 && error <= std::max(kVagueDelay, 0.25 * largest))
    return read;
  read.warnings.push_back(
      fmt::format("the delay between torque and position is not determined ({:.3g} +- {:.3g} samples, "
                  "searched within {:.3g}): taken as 0",
                  read.solution.delay, error, largest));
  read.solution = solve(s, a, 0, false);
  read.delay = {0, std::numeric_limits<double>::quiet_NaN()};
  return read;
}

/// Whether half of the band says another inertia, or the same far more surely, or has a delay where all of it
/// puts it at the edge of the search.
bool counts_instead(const Read& half, const Read& whole) {
  const double a = whole.solution.fit.values[0], b = half.solution.fit.values[0];
  const double ea = whole.solution.error[0], eb = half.solution.error[0];
  const bool delay = std::isnan(whole.delay.standard_error) && !std::isnan(half.delay.standard_error);
  return delay || std::fabs(a - b) > kAnother * std::hypot(ea, eb) || eb < kSurer * ea;
}

/// In the widest band that agrees with its lower half.
Read read_machine(const record::EvenGrid& grid, const OneInertiaOptions& options) {
  Read read = read_band(grid, options.cutoff, options, 0);
  while (options.cutoff == 0) {
    const double half = 0.5 * read.signals.cutoff;
    if (half * double(grid.record.size()) * read.signals.interval < kFewestPeriods) return read;
    try {
      Read lower = read_band(grid, half, options, kSmoothed * half);
      if (!counts_instead(lower, read)) return read;
      read = std::move(lower);
    } catch (const CannotIdentify&) {  // too slow to see both directions
      return read;
    }
  }
  return read;
}

}  // namespace

OneInertia identify_one_inertia(const record::Record& recorded, const OneInertiaOptions& options) {
  require_torque_and_position(recorded);
  const record::EvenGrid grid = grid_with_losses(recorded, options.lost);
  const record::Record& record = grid.record;
  Read read = read_machine(grid, options);
  const Signals& s = read.signals;
  const Eigen::MatrixXd& a = read.columns;
  Solution& solution = read.solution;
  const signal::LeastSquaresFit& fit = solution.fit;
  OneInertia out;
  out.delay = read.delay;
  out.warnings = read.warnings;
  out.gravity = options.gravity;
  out.cutoff = s.cutoff;
  out.smoothed = read.smoothed;
  out.used = double(s.used.size()) / double(s.time.size());
  const Eigen::VectorXd predicted = a * fit.values, measured = predicted + fit.residuals;
  out.relative_error = std::sqrt(fit.residuals.squaredNorm() / double(measured.size())) / spread(measured);
  out.floor = floor_of(record, s, fit.values[0], spread(measured));
  if (out.relative_error > kShowsMissingEffect * out.floor)
    allow_for_missing(solution, s, a, record, out.floor * spread(measured) * std::sqrt(double(a.rows())));
  const std::vector<signal::Measured OneInertia::*> names = fitted_members(options.gravity);
  for (std::size_t i = 0; i < names.size(); ++i)
    out.*names[i] = {fit.values[Eigen::Index(i)], solution.error[Eigen::Index(i)]};
  for (const auto k : s.used) out.time.push_back(s.time[k]);
  out.measured.assign(measured.begin(), measured.end());
  out.predicted.assign(predicted.begin(), predicted.end());
  if (out.relative_error > std::max(kMuchLeft, 3 * out.floor))
    out.warnings.push_back(
        fmt::format("the model leaves {:.3g} % of the torque, noise alone would leave {:.3g} %: the machine "
                    "has effects that one inertia with friction lacks",
                    100 * out.relative_error, 100 * out.floor));
  return out;
}

OneInertia applied(const OneInertia& machine, const record::Record& recorded, const std::vector<bool>& lost) {
  require_torque_and_position(recorded);
  const record::EvenGrid grid = grid_with_losses(recorded, lost);
  const record::Record& record = grid.record;
  const Signals s = one_inertia_signals(grid, machine.cutoff, machine.gravity, machine.smoothed);
  if (s.used.size() < 2) throw CannotIdentify(record.name + ": stands still");
  const Eigen::VectorXd torque =
      picked(low_pass_sliding(s, signal::delayed(s.torque, machine.delay.value / s.interval)), s.used);
  const auto names = fitted_members(machine.gravity);
  Eigen::VectorXd p(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) p[Eigen::Index(i)] = (machine.*names[i]).value;
  const Eigen::VectorXd predicted = picked(s.columns, s.used) * p;
  OneInertia out = machine;
  out.used = double(s.used.size()) / double(s.time.size());
  out.relative_error = std::sqrt((torque - predicted).squaredNorm() / double(torque.size())) / spread(torque);
  out.floor = floor_of(record, s, machine.inertia.value, spread(torque));
  out.time.clear();
  for (const auto k : s.used) out.time.push_back(s.time[k]);
  out.measured.assign(torque.begin(), torque.end());
  out.predicted.assign(predicted.begin(), predicted.end());
  return out;
}

OneInertia combined(const std::vector<OneInertia>& machines) {
  OneInertia all = machines.front();
  if (machines.size() == 1) return all;  // whatever its errors, which may be 0 without any noise
  const bool drawn = std::any_of(machines.begin(), machines.end(), [](const OneInertia& m) {
    return m.relative_error > kShowsMissingEffect * m.floor;
  });
  for (signal::Measured OneInertia::*parameter : fitted_members(all.gravity)) {
    std::vector<signal::Measured> values;
    double least = std::numeric_limits<double>::infinity();
    for (const OneInertia& m : machines) {
      values.push_back(m.*parameter);
      least = std::min(least, (m.*parameter).standard_error);
    }
    all.*parameter = signal::weighted_mean(values);
    if (drawn) (all.*parameter).standard_error = std::max((all.*parameter).standard_error, least);
  }
  return all;
}

}  // namespace backlash::identification
