// SPDX-License-Identifier: BSD-3-Clause
#include "balance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr double kMixed = 0.1;  // choice: weight of samples that do not count in one that does
constexpr double kPressed =
    0.2;  // choice: of the rms torque through the teeth, from which a flank is pressed
constexpr double kPerPeriod = 5;  // choice: rows in a period of the cutoff
constexpr double kSettles = 3;    // theory: periods of the cutoff, at either end of a record

double rms(const std::vector<double>& x) {
  double square = 0;
  for (const double v : x) square += v * v;
  return std::sqrt(square / double(std::max<std::size_t>(1, x.size())));
}

/// Samples, a few per period of the cutoff, that the low-pass hardly mixes with those that do not count.
std::vector<std::size_t> rows_where(const std::vector<double>& counts, double interval, double cutoff) {
  std::vector<double> not_counted(counts.size());
  for (std::size_t k = 0; k < counts.size(); ++k) not_counted[k] = 1 - counts[k];
  const std::vector<double> mixed = signal::low_pass(not_counted, interval, cutoff);
  const auto step = std::size_t(std::max(1.0, 1 / (kPerPeriod * cutoff * interval)));
  const auto ends = std::size_t(kSettles / (cutoff * interval));
  std::vector<std::size_t> rows;
  for (std::size_t k = ends; k + ends < counts.size(); k += step)
    if (counts[k] > 0 && std::fabs(mixed[k]) < kMixed) rows.push_back(k);
  return rows;
}

/// Sine and cosine of an effect with a phase, else the term itself: what its strength may change.
std::vector<std::shared_ptr<const model::Term>> directions(const model::Term& term) {
  const auto& search = model::term_type(term.id).search;
  if (!search) return {};
  std::vector<std::shared_ptr<const model::Term>> all;
  for (const double phase : {0.0, M_PI / 2}) {
    ParameterValues values = term.values;
    if (!search->phase.empty()) values[search->phase] = phase;
    all.push_back(model::make_term(term.id, values));
    if (search->phase.empty()) break;
  }
  return all;
}

}  // namespace

Balance::Balance(const Machine& machine, const std::vector<ServoData>& data, const Cutoffs& cutoffs)
    : rig_(machine.rig),
      cutoffs_(cutoffs),
      load_inertia_(model::GearTrain(machine.rig).load_inertia()),
      stiffness_(rig_file::servo_parameter(rig_file::RigPart::mesh, rig_file::ParameterKind::stiffness)
                     .get(machine.rig)) {
  for (std::size_t i = 0; i < data.size(); ++i) parts_.push_back(part_of(data[i], machine.calibrations[i]));
  for (const Part& part : parts_)
    for (const bool deflection : {false, true})
      for (const std::size_t k : deflection ? part.deflection_rows : part.torque_rows) {
        deflection_.push_back(deflection);
        time_.push_back(double(k) / double(part.samples.size()));
      }
  weights_ = Eigen::VectorXd::Ones(Eigen::Index(deflection_.size()));
  const Eigen::VectorXd signal = measured(machine, data);
  std::vector<Eigen::VectorXd> known = base(data);
  for (const auto& term : rig_.terms)
    for (const auto& direction : directions(*term)) known.push_back(rows_of(*direction));
  Eigen::MatrixXd columns(signal.size(), Eigen::Index(known.size()));
  for (std::size_t i = 0; i < known.size(); ++i) columns.col(Eigen::Index(i)) = known[i];
  // What one channel alone knows must not depend on the units of the other.
  const auto fit = [&] {
    Eigen::MatrixXd weighed = weights_.asDiagonal() * columns;
    for (Eigen::Index i = 0; i < weighed.cols(); ++i)
      weighed.col(i) /= std::max(weighed.col(i).norm(), std::numeric_limits<double>::min());
    basis_ = signal::orthonormal_basis(weighed);
    left_ = weights_.cwiseProduct(signal);
    left_ -= basis_ * (basis_.transpose() * left_);
  };
  scale(signal);
  fit();
  scale(left_.cwiseQuotient(weights_));
  fit();
  for (const int channel : {0, 1}) {
    double sum = 0, square = 0, count = 0;
    for (Eigen::Index i = 0; i < signal.size(); ++i) {
      if (deflection_[std::size_t(i)] != channel) continue;
      const double value = weights_[i] * signal[i];
      sum += value, square += value * value, ++count;
    }
    if (count > 0) signal_[channel] = std::sqrt(std::max(0.0, square / count - std::pow(sum / count, 2)));
  }
}

/// Each channel in units of its root mean square in `signal`.
void Balance::scale(const Eigen::VectorXd& signal) {
  double square[2] = {0, 0}, count[2] = {0, 0};
  for (Eigen::Index i = 0; i < signal.size(); ++i) {
    const std::size_t channel = deflection_[std::size_t(i)] ? 1 : 0;
    square[channel] += signal[i] * signal[i], ++count[channel];
  }
  for (Eigen::Index i = 0; i < signal.size(); ++i) {
    const std::size_t channel = deflection_[std::size_t(i)] ? 1 : 0;
    weights_[i] = square[channel] > 0 ? std::sqrt(count[channel] / square[channel]) : 0;
  }
}

Balance::Part Balance::part_of(const ServoData& data, const Calibration& calibration) const {
  const PreparedServo prepared(data, cutoffs_.torque, 0);
  const std::vector<double> acceleration =
      signal::low_pass(signal::derivative(data.load_rate, data.interval), data.interval, cutoffs_.deflection);
  std::vector<double> through(data.size()), slides(data.size()), pressed(data.size());
  for (std::size_t k = 0; k < data.size(); ++k)
    through[k] = load_inertia_ * acceleration[k] + rig_.link.viscous_damping * data.load_rate[k] +
                 rig_.link.coulomb_friction * prepared.direction[k];
  const double usual = rms(through);
  Part part;
  part.interval = data.interval;
  for (std::size_t k = 0; k < data.size(); ++k) {
    Sample s;
    s.motion = {data.start + double(k) * data.interval,    data.motor[k],     data.motor_rate[k],
                data.load[k] - calibration.encoder_offset, data.load_rate[k], through[k]};
    s.direction = prepared.direction[k];
    if (std::fabs(through[k]) > kPressed * usual) s.side = through[k] > 0 ? 1 : -1;
    slides[k] = s.direction != 0, pressed[k] = s.side != 0;
    if (!data.lost.empty() && data.lost[k]) slides[k] = pressed[k] = 0;
    part.samples.push_back(s);
  }
  part.torque_rows = rows_where(slides, data.interval, cutoffs_.torque);
  part.deflection_rows = rows_where(pressed, data.interval, cutoffs_.deflection);
  return part;
}

Balance::Sums Balance::sums_of(const model::Term& term, const Part& part) const {
  Sums sums{std::vector<double>(part.samples.size()), std::vector<double>(part.samples.size())};
  const double half_gap = 0.5 * rig_.mesh.backlash / rig_.mesh.lever();
  model::Sensing sensing;
  term.sense(sensing);
  for (std::size_t k = 0; k < part.samples.size(); ++k) {
    const Sample& s = part.samples[k];
    model::EndTorques torques;
    term.add(s.motion, torques);
    model::EndFriction friction;
    if (term.has_dry_friction()) term.add_friction(s.motion, friction);
    const auto rubs = [&](const model::FrictionLimits& f) {
      return s.direction > 0 ? f.forward : s.direction < 0 ? -f.backward : 0.0;
    };
    const double of_load = rubs(friction.load) - torques.load;
    sums.torque[k] = rubs(friction.motor) - torques.motor + of_load;
    const int side = int(s.side);
    model::FlankShift shift;
    double resists = 0;  // N m
    if (side != 0 && term.shapes_flanks())
      term.shape({s.motion.motor_position, s.motion.load_position, half_gap, s.motion.mesh_torque, side},
                 shift);
    if (side != 0 && term.loads_flanks())
      term.load_flank(
          {{s.motion.motor_position, s.motion.load_position, half_gap, s.motion.mesh_torque, side},
           std::fabs(s.motion.mesh_torque) / stiffness_,
           0},
          resists);
    sums.deflection[k] = side * (shift.opening - resists / stiffness_) + of_load / stiffness_ -
                         (sensing.load_position_gain - 1) * s.motion.load_position;
  }
  return sums;
}

Eigen::VectorXd Balance::rows(const std::vector<Sums>& of_parts) const {
  Eigen::VectorXd all(weights_.size());
  Eigen::Index next = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Part& part = parts_[i];
    const std::vector<double> torque = signal::low_pass(of_parts[i].torque, part.interval, cutoffs_.torque),
                              deflection = signal::low_pass(of_parts[i].deflection, part.interval,
                                                            cutoffs_.deflection);
    for (const std::size_t k : part.torque_rows) all[next++] = torque[k];
    for (const std::size_t k : part.deflection_rows) all[next++] = deflection[k];
  }
  return all;
}

Eigen::VectorXd Balance::rows_of(const model::Term& term) const {
  std::vector<Sums> all;
  for (const Part& part : parts_) all.push_back(sums_of(term, part));
  return rows(all);
}

Eigen::VectorXd Balance::measured(const Machine& machine, const std::vector<ServoData>& data) const {
  std::vector<Sums> all;
  for (std::size_t i = 0; i < data.size(); ++i) {
    Sums sums;
    sums.torque = PreparedServo(data[i], cutoffs_.torque, 0).acting_torque(rig_, machine.calibrations[i]);
    for (std::size_t k = 0; k < data[i].size(); ++k)
      sums.deflection.push_back(data[i].motor[k] - data[i].load[k]);
    all.push_back(std::move(sums));
  }
  Eigen::VectorXd signal = rows(all);
  for (const auto& term : rig_.terms) signal -= rows_of(*term);
  return signal;
}

std::vector<Eigen::VectorXd> Balance::base(const std::vector<ServoData>& data) const {
  std::vector<Eigen::VectorXd> columns;
  const auto add = [&](const auto& torque_of, const auto& deflection_of) {
    std::vector<Sums> all;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      Sums sums;
      for (std::size_t k = 0; k < data[i].size(); ++k) {
        sums.torque.push_back(torque_of(i, k));
        sums.deflection.push_back(deflection_of(i, k));
      }
      all.push_back(std::move(sums));
    }
    columns.push_back(rows(all));
  };
  std::vector<std::vector<double>> load_acceleration;
  for (const ServoData& d : data) load_acceleration.push_back(signal::derivative(d.load_rate, d.interval));
  const auto none = [](std::size_t, std::size_t) { return 0.0; };
  const auto sample = [&](std::size_t i, std::size_t k) -> const Sample& { return parts_[i].samples[k]; };
  add([&](std::size_t i, std::size_t k) { return data[i].motor_acceleration[k]; }, none);
  add([&](std::size_t i, std::size_t k) { return load_acceleration[i][k]; }, none);
  add([&](std::size_t i, std::size_t k) { return data[i].motor_rate[k]; }, none);
  add([&](std::size_t i, std::size_t k) { return sample(i, k).direction; }, none);
  add(none, [&](std::size_t i, std::size_t k) { return 0.5 * sample(i, k).side; });
  add(none, [&](std::size_t i, std::size_t k) { return sample(i, k).motion.mesh_torque; });
  add(none, [&](std::size_t i, std::size_t k) { return data[i].load_rate[k]; });
  for (std::size_t own = 0; own < parts_.size(); ++own)
    add(none, [&](std::size_t i, std::size_t) { return i == own ? 1.0 : 0.0; });
  return columns;
}

ResidualOrders Balance::orders() const {
  std::vector<ResidualOrders::Row> rows;
  for (const Part& part : parts_)
    for (const bool deflection : {false, true})
      for (const std::size_t k : deflection ? part.deflection_rows : part.torque_rows)
        rows.push_back(
            {deflection, true, deflection ? cutoffs_.deflection : cutoffs_.torque, part.samples[k].motion});
  return {std::move(rows), left_, basis_};
}

Eigen::VectorXd Balance::column(const model::Term& term, double least_own) const {
  const Eigen::VectorXd change = -weights_.cwiseProduct(rows_of(term));
  Eigen::VectorXd own = change - basis_ * (basis_.transpose() * change);
  if (!(own.norm() >= least_own * change.norm()) || change.norm() == 0) own.setZero();
  return own;
}

struct Balance::Squares {
  std::array<double, 2> before = {0, 0}, after = {0, 0}, count = {0, 0};

  double decrease(std::size_t channel) const { return before[channel] - after[channel]; }
  double gain(std::size_t channel) const {
    return before[channel] > 0 ? 1 - std::sqrt(after[channel] / before[channel]) : 0;
  }
  void add(const Squares& other) {
    for (const std::size_t c : {0, 1})
      before[c] += other.before[c], after[c] += other.after[c], count[c] += other.count[c];
  }
};

Balance::Squares Balance::squares_of(const std::vector<Eigen::Index>& rows, const Eigen::MatrixXd& columns,
                                     const Eigen::VectorXd& factors) const {
  Squares s;
  for (const Eigen::Index i : rows) {
    const std::size_t channel = deflection_[std::size_t(i)] ? 1 : 0;
    s.before[channel] += std::pow(left_[i], 2), ++s.count[channel];
    s.after[channel] += std::pow(left_[i] - columns.row(i).dot(factors), 2);
  }
  return s;
}

Balance::Explained Balance::explained(const Eigen::MatrixXd& columns, int blocks) const {
  const Eigen::MatrixXd normal = signal::gram(columns);
  const Eigen::VectorXd gradient = columns.transpose() * left_;
  const auto rows_where = [&](const auto& wanted) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < left_.size(); ++i)
      if (wanted(time_[std::size_t(i)])) rows.push_back(i);
    return rows;
  };
  /// Of rows, with the factors that all others want.
  const auto without = [&](const std::vector<Eigen::Index>& rows) {
    const Eigen::MatrixXd own = columns(rows, Eigen::all);
    const Eigen::VectorXd of_left = left_(rows);
    return squares_of(
        rows, columns,
        signal::solve_symmetric(normal - signal::gram(own), gradient - own.transpose() * of_left));
  };
  Squares held_out;
  for (int b = 0; b < blocks; ++b)
    held_out.add(without(rows_where([&](double t) { return std::min(blocks - 1, int(blocks * t)) == b; })));
  Explained out;
  out.deflection = held_out.decrease(1) > held_out.decrease(0);
  const auto channel = std::size_t(out.deflection);
  out.gain =
      squares_of(rows_where([](double) { return true; }), columns, signal::solve_symmetric(normal, gradient))
          .gain(channel);
  out.gain_held_out = held_out.gain(channel);
  out.of_signal =
      std::sqrt(std::max(0.0, held_out.decrease(channel)) / held_out.count[channel]) / signal_[channel];
  return out;
}

}  // namespace backlash::identification
