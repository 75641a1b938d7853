// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/line_inertia.h"

#include <fmt/core.h>

#include <Eigen/Core>
#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <complex>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/blocks.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

using Complex = std::complex<double>;

constexpr std::size_t kLeastCycles = 4;  // choice
constexpr double kLeastShare = 0.5;      // choice: of the speed's variance that the sine must explain
constexpr double kSettled = 1e-3;        // choice: of the amplitude, of a cycle from those of the second half
constexpr double kScatter = 4;           // choice: deviations of those, the same
constexpr std::size_t kMostGroups = 20;  // choice: of cycles, for the error
constexpr int kCycleBits = 22;           // choice: of the number of cycles, relative 5e-7

/// x = Re(amplitude exp(i w k)) + polynomial, k in samples.
struct Sine {
  Complex amplitude;
  double mean, slope, explained;
  Eigen::MatrixXd columns;
  Eigen::VectorXd residuals;
};

/// `polynomial` 1: mean and slope, 2: curvature too; `w` in rad per sample. The sine has the last two
/// columns.
Sine fit_sine(const std::vector<double>& values, std::size_t begin, std::size_t count, double w,
              int polynomial) {
  Sine sine;
  Eigen::MatrixXd& a = sine.columns;
  a.resize(count, polynomial + 3);
  const Eigen::Map<const Eigen::VectorXd> b(values.data() + begin, Eigen::Index(count));
  for (std::size_t k = 0; k < count; ++k) {
    const double u = 2 * double(k) / double(count - 1) - 1;
    for (int p = 0; p <= polynomial; ++p) a(k, p) = std::pow(u, p);
    a(k, polynomial + 1) = std::cos(w * double(begin + k));
    a(k, polynomial + 2) = -std::sin(w * double(begin + k));
  }
  const signal::LeastSquaresFit fit = signal::fit_linear(a, b);
  sine.amplitude = {fit.values[polynomial + 1], fit.values[polynomial + 2]};
  sine.mean = fit.values[0];
  sine.slope = fit.values[1];
  sine.residuals = fit.residuals;
  const double power = 0.5 * std::norm(sine.amplitude);
  sine.explained = power / (power + fit.residuals.squaredNorm() / double(count));
  return sine;
}

/// How the amplitude changes where one cycle (or group of cycles) is left out.
Eigen::VectorXcd changes_of(const Sine& sine, std::size_t groups) {
  const auto rows = static_cast<std::size_t>(sine.columns.rows());
  std::vector<std::size_t> block;
  for (std::size_t k = 0; k < rows; ++k) block.push_back(k * groups / rows);
  const Eigen::MatrixXd changes = signal::jackknife_changes(sine.columns, sine.residuals, block);
  const Eigen::Index last = changes.rows() - 1;
  return changes.row(last - 1).transpose() + Complex(0, 1) * changes.row(last).transpose();
}

/// The signal about its straight line, thinned to at most some 4000 values, under a Hann window.
Eigen::VectorXd windowed(const std::vector<double>& values, std::size_t step) {
  const std::vector<double> thin = signal::block_means(values, step);
  const auto n = static_cast<Eigen::Index>(thin.size());
  Eigen::MatrixXd a(n, 2);
  a << Eigen::VectorXd::Ones(n), Eigen::VectorXd::LinSpaced(n, -1, 1);
  const Eigen::ArrayXd phase = 2 * M_PI / double(n) * (Eigen::ArrayXd::LinSpaced(n, 0, double(n - 1)) + 0.5);
  return signal::fit_linear(a, Eigen::Map<const Eigen::VectorXd>(thin.data(), n)).residuals.array() *
         (1 - phase.cos());
}

/// Frequency in rad per sample: the largest of a grid of whole cycles, refined between its neighbours.
double largest_line(const std::vector<double>& values) {
  const std::size_t step = std::max<std::size_t>(1, values.size() / 4000);
  const Eigen::VectorXd x = windowed(values, step);
  const double width = 2 * M_PI / double(x.size());
  const auto power = [&](double w) {
    Complex sum = 0, phase = 1;
    const Complex turn = std::polar(1.0, w);
    for (const double value : x) sum += value * phase, phase *= turn;
    return std::norm(sum);
  };
  double best = double(kLeastCycles), most = 0;
  for (Eigen::Index i = kLeastCycles; i < x.size() / 4; ++i)
    if (const double p = power(width * double(i)); p > most) most = p, best = double(i);
  const auto missing = [&](double cycles) { return -power(width * cycles); };
  const double cycles = boost::math::tools::brent_find_minima(missing, best - 1, best + 1, kCycleBits).first;
  return width * cycles / double(step);
}

/// Leading cycles whose sine differs from those of the second half: it is faded in, or a transient dies. At
/// most half of them.
std::size_t unsettled_cycles(const std::vector<double>& speed, std::size_t begin, std::size_t cycles,
                             double w) {
  const double per_cycle = 2 * M_PI / w;
  const auto length = static_cast<std::size_t>(per_cycle);
  Eigen::VectorXcd amplitude(cycles);
  for (std::size_t i = 0; i < cycles; ++i)
    amplitude[i] =
        fit_sine(speed, begin + static_cast<std::size_t>(double(i) * per_cycle), length, w, 1).amplitude;
  const auto later = amplitude.tail(cycles - cycles / 2);
  const Complex mean = later.mean();
  const double scatter = std::sqrt((later.array() - mean).abs2().mean());
  std::size_t first = 0;
  while (first < cycles / 2 &&
         std::abs(amplitude[first] - mean) > std::max(kSettled * std::abs(mean), kScatter * scatter))
    ++first;
  return first;
}

/// The part of the record that is used, in samples, and the line.
struct Section {
  std::size_t begin, count, cycles;
  double w;         // rad per sample
  double interval;  // s
};

Section choose(const record::Record& record, const LineInertiaOptions& options,
               const std::vector<double>& speed) {
  Section s;
  s.interval = record.sampling_interval();
  s.w = options.frequency > 0 ? 2 * M_PI * options.frequency * s.interval : largest_line(speed);
  const double per_cycle = 2 * M_PI / s.w;
  const auto skip = [&](double cycles) {
    s.begin = static_cast<std::size_t>(std::lround(cycles * per_cycle));
    s.cycles = record.size() > s.begin
                   ? static_cast<std::size_t>((double(record.size() - s.begin) + 0.5) / per_cycle)
                   : 0;
  };
  skip(options.skip);
  if (s.cycles > kLeastCycles && per_cycle > 8)
    skip(options.skip + double(unsettled_cycles(speed, s.begin, s.cycles, s.w)));
  if (s.cycles < kLeastCycles)
    throw CannotIdentify(fmt::format("{}: {} cycles of {:.3g} Hz after the start, inertia needs {}",
                                     record.name, s.cycles, s.w / (2 * M_PI * s.interval), kLeastCycles));
  s.count = std::min<std::size_t>(record.size() - s.begin, std::lround(double(s.cycles) * per_cycle));
  return s;
}

/// Torque over speed at the line, and its error.
struct Impedance {
  Complex value;   // N m s/rad
  Complex errors;  // of real and imaginary part
};

Impedance impedance(const record::Record& record, const Section& s, double delay) {
  const bool by_position = record.has(record::Channel::motor_position);
  const Sine torque = fit_sine(record.column(record::Channel::motor_torque), s.begin, s.count, s.w, 1);
  const Sine motion =
      by_position ? fit_sine(record.column(record::Channel::motor_position), s.begin, s.count, s.w, 2)
                  : fit_sine(record.column(record::Channel::motor_velocity), s.begin, s.count, s.w, 1);
  const Complex turn = std::polar(1.0, -s.w * delay / s.interval) /
                       (by_position ? Complex(0, s.w / s.interval) : Complex(1, 0));
  const Complex z = torque.amplitude / motion.amplitude;
  const std::size_t groups = std::min(s.cycles, kMostGroups);
  const Eigen::VectorXcd changes =
      (changes_of(torque, groups) - z * changes_of(motion, groups)) * (turn / motion.amplitude);
  return {z * turn, {signal::jackknife_error(changes.real()), signal::jackknife_error(changes.imag())}};
}

void require_one_way(const record::Record& record, const Sine& speed) {
  const double least = std::fabs(speed.mean) - std::fabs(speed.slope) - std::abs(speed.amplitude);
  if (speed.explained < kLeastShare)
    throw CannotIdentify(
        fmt::format("{}: no sine stands out of the speed (it explains {:.3g} % of the variance)", record.name,
                    100 * speed.explained));
  if (least <= 0)
    throw CannotIdentify(
        fmt::format("{}: the speed reverses (mean {:.3g} rad/s, amplitude {:.3g} rad/s): Coulomb friction "
                    "would count as inertia and damping",
                    record.name, speed.mean, std::abs(speed.amplitude)));
}

/// The motion of everything that turns as one: mean of motor and load, weighted with their
/// inertias.
record::Record weighted(record::Record record, double motor_share) {
  const std::pair<record::Channel, record::Channel> pairs[] = {
      {record::Channel::motor_position, record::Channel::load_position},
      {record::Channel::motor_velocity, record::Channel::load_velocity}};
  for (const auto& [motor, load] : pairs) {
    if (!record.has(motor) || !record.has(load)) continue;
    std::vector<double>& m = record.column(motor);
    const std::vector<double>& l = record.column(load);
    for (std::size_t k = 0; k < m.size(); ++k) m[k] = motor_share * m[k] + (1 - motor_share) * l[k];
  }
  return record;
}

}  // namespace

LineInertia line_inertia(const record::Record& recorded, const LineInertiaOptions& options) {
  if (!(options.frequency >= 0)) throw InvalidParameter("frequency", options.frequency, "must be >= 0 Hz");
  if (!(options.skip >= 0)) throw InvalidParameter("skip", options.skip, "must be >= 0 cycles");
  if (!(options.motor_share >= 0 && options.motor_share <= 1))
    throw InvalidParameter("motor_share", options.motor_share, "must be 0 to 1");
  if (!recorded.has(record::Channel::motor_torque) ||
      !(recorded.has(record::Channel::motor_position) || recorded.has(record::Channel::motor_velocity)))
    throw CannotIdentify(recorded.name + ": inertia needs motor_torque and motor_position or motor_velocity");
  record::Record record = record::evenly_sampled(recorded);
  if (options.motor_share < 1) record = weighted(std::move(record), options.motor_share);
  const std::vector<double> speed =
      record.has(record::Channel::motor_velocity)
          ? record.column(record::Channel::motor_velocity)
          : signal::derivative(record.column(record::Channel::motor_position), record.sampling_interval());
  const Section s = choose(record, options, speed);
  const Sine whole = fit_sine(speed, s.begin, s.count, s.w, 1);
  require_one_way(record, whole);
  const double omega = s.w / s.interval;
  const Impedance z = impedance(record, s, options.torque_delay);
  LineInertia out;
  out.inertia = {z.value.imag() / omega, z.errors.imag() / omega};
  out.viscous = {z.value.real(), z.errors.real()};
  out.frequency = omega / (2 * M_PI);
  out.speed = std::abs(whole.amplitude);
  out.torque = std::abs(z.value) * out.speed;
  out.mean_speed = whole.mean;
  out.cycles = s.cycles;
  return out;
}

double inertia_from_amplitudes(double torque, double speed, double frequency, double viscous) {
  if (!(torque > 0)) throw InvalidParameter("torque", torque, "must be > 0 N m");
  if (!(speed > 0)) throw InvalidParameter("speed", speed, "must be > 0 rad/s");
  if (!(frequency > 0)) throw InvalidParameter("frequency", frequency, "must be > 0 Hz");
  if (!(viscous >= 0 && viscous * speed < torque))
    throw InvalidParameter("viscous", viscous, "must be >= 0 and take less than the torque");
  const double damping = viscous * speed;
  return std::sqrt(torque * torque - damping * damping) / (2 * M_PI * frequency * speed);
}

}  // namespace backlash::identification
