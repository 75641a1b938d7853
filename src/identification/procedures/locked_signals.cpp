// SPDX-License-Identifier: BSD-3-Clause
#include "locked_signals.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "../fit/servo_prediction.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/bandwidth.h"
#include "backlash_diagnosis/signal/block_regression.h"
#include "backlash_diagnosis/signal/noise.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr double kOversampling = 1.25;   // theory: rows per second over 2 cutoff
constexpr double kLeastShare = 0.02;     // choice: of the samples, that slide in each direction
constexpr double kBeyondChance = 8;      // choice: standard deviations of a correlation of white noises
constexpr double kReach = 0.3;           // theory: periods of its band that a smooth speed is sharp to
constexpr double kChance = 3;            // choice: the same, that chance may hide
constexpr double kTurns = 0.5;           // choice: of the usual speed, that a sample's torque takes or gives
constexpr std::size_t kFewestRows = 64;  // choice
constexpr std::size_t kFewestSamples = 64;  // theory: for the noise of a position (bandwidth.h)

/// The rig without what columns and mesh already contain.
model::Rig plain(model::Rig rig) {
  rig.terms.clear();
  rig.motor.viscous_asymmetry = 0;
  return rig;
}

std::vector<double> above(std::vector<double> values, double interval, double cutoff) {
  const std::vector<double> slow = signal::low_pass(values, interval, cutoff);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] -= slow[k];
  return values;
}

/// Where the motor moves one way over all samples within `reach`.
std::vector<int> sliding(const std::vector<int>& direction, long reach) {
  std::vector<int> sure = direction;
  const long n = long(direction.size());
  for (long k = 1; k < n; ++k) {
    if (direction[k] == direction[k - 1]) continue;
    for (long j = std::max(0L, k - reach); j < std::min(n, k + reach); ++j) sure[j] = 0;
  }
  return sure;
}

/// Correlation of x[k] with y[k + lag] over the samples that count, and how many these are.
std::pair<double, double> correlation(const std::vector<double>& x, const std::vector<double>& y, long lag,
                                      const std::vector<char>& counts) {
  double xx = 0, yy = 0, xy = 0, n = 0;
  for (long k = std::max(0L, -lag); k < long(y.size()) - std::max(0L, lag); ++k) {
    if (!counts[k]) continue;
    xx += x[k] * x[k];
    yy += y[k + lag] * y[k + lag];
    xy += x[k] * y[k + lag];
    ++n;
  }
  return {xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0, n};
}

}  // namespace

LockedSignals::LockedSignals(const record::Record& recorded, const model::Rig& rig) {
  const record::Record record = record::evenly_sampled(recorded);
  if (record.size() < kFewestSamples)
    throw CannotIdentify(fmt::format("{}: only {} samples", record.name, record.size()));
  data_ = servo_data(record, rig);
  position_ = record.column(record::Channel::motor_position);
  position_noise_ =
      std::max(signal::position_noise(position_), signal::resolution(position_) / std::sqrt(12.0));
  data_.load.clear();
  cutoff_ = with_bands({}, rig, {data_}).cutoff;
  const PreparedServo prepared(data_, cutoff_, 0);
  direction_ = sliding(prepared.direction, reach());
  usual_speed_ = signal::median_magnitude(data_.motor_rate);
  fast_torque_ = above(data_.torque, data_.interval, cutoff_);
  // Of a step from sample to sample: a central difference does not see what turns round each sample.
  fast_step_ = above(signal::differences(position_, 1), data_.interval, cutoff_);
  counts_ = prepared.counts;
  const auto stride = std::max(1L, std::lround(1 / (2 * kOversampling * cutoff_ * data_.interval)));
  long forward = 0, backward = 0;
  for (long k = 0; k < long(data_.size()); ++k) {
    counts_[k] = counts_[k] && direction_[k] != 0;
    if (!counts_[k]) continue;
    (direction_[k] > 0 ? forward : backward) += 1;
    if (k % stride == 0) rows_.push_back(k);
  }
  const auto least = static_cast<long>(std::ceil(kLeastShare * double(data_.size())));
  if (std::min(forward, backward) < least || rows_.size() < kFewestRows)
    throw CannotIdentify(fmt::format(
        "{}: the motor surely slides forward in {:.2g} % and backward in {:.2g} % of the samples "
        "({} that are independent); needed are {:.2g} % each and {}",
        record.name, 100.0 * double(forward) / double(data_.size()),
        100.0 * double(backward) / double(data_.size()), rows_.size(), 100 * kLeastShare, kFewestRows));
  columns_.resize(Eigen::Index(data_.size()), 4);
  columns_.col(0) = low_passed(data_.motor_acceleration);
  columns_.col(1) = low_passed(data_.motor_rate);
  columns_.col(2) = low_passed({direction_.begin(), direction_.end()});
  columns_.col(3) = low_passed(std::vector<double>(data_.size(), 1.0));
}

long LockedSignals::reach() const {
  const double t = data_.interval, per_band = 2 * M_PI * std::sqrt(2 * t / 3);  // of rate noise: band^1.5
  const double band = std::pow(data_.rate_noise / (per_band * position_noise_), 2.0 / 3);
  return position_noise_ > 0 ? std::lround(kReach / (band * t)) : 0;
}

Eigen::VectorXd LockedSignals::low_passed(std::vector<double> values) const {
  for (std::size_t k = 0; k < values.size(); ++k)
    if (direction_[k] == 0) values[k] = 0;
  const std::vector<double> smooth = signal::low_pass(values, data_.interval, cutoff_);
  return Eigen::Map<const Eigen::VectorXd>(smooth.data(), Eigen::Index(smooth.size()));
}

Eigen::VectorXd LockedSignals::torque(const model::Rig& rig, const LockedMesh& mesh) const {
  const PreparedServo prepared(data_, cutoff_, 0);
  Calibration of_moment;
  of_moment.held = false;
  std::vector<double> torque = prepared.acting_torque(rig, of_moment);
  if (rig.terms.empty() && rig.motor.viscous_asymmetry == 0) return low_passed(std::move(torque));
  of_moment.encoder_offset = -mesh.centre();
  const std::vector<double> with = prepared.residuals(rig, of_moment).predicted_torque,
                            without = prepared.residuals(plain(rig), of_moment).predicted_torque;
  for (std::size_t k = 0; k < torque.size(); ++k) torque[k] -= with[k] - without[k];
  return low_passed(std::move(torque));
}

/// White noise of the position, differentiated twice and once up to the cutoff: the squares of the gains
/// (2 pi f)^2 and 2 pi f integrated. What is smooth already has less.
std::pair<double, double> LockedSignals::noise_of_motion() const {
  const double t = data_.interval, w = 2 * M_PI * cutoff_,
               speed = w * std::sqrt(2 * cutoff_ * t / 3) * position_noise_;
  const double left = std::min(speed, data_.rate_noise);
  return {left * w * std::sqrt(0.6), left};
}

Eigen::MatrixXd LockedSignals::states(int count) const {
  std::vector<double> position, speed;
  Eigen::MatrixXd way(rows_.size(), 2);
  for (const Eigen::Index k : rows_) {
    position.push_back(data_.motor[std::size_t(k)]);
    speed.push_back(std::fabs(data_.motor_rate[std::size_t(k)]));
  }
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const bool forward = direction_[std::size_t(rows_[i])] > 0;
    way.row(Eigen::Index(i)) << forward, !forward;
  }
  const Eigen::MatrixXd where = signal::row_products(signal::hat_functions(position, count), way),
                        fast = signal::row_products(signal::hat_functions(speed, count), way);
  Eigen::MatrixXd all(way.rows(), where.cols() + fast.cols());
  all << where, fast;
  return all;
}

double LockedSignals::answer() const {
  double most = 0;
  for (const long lag : {-1L, 0L, 1L}) {
    const auto [r, samples] = correlation(fast_torque_, fast_step_, lag, counts_);
    most = std::max(most, std::fabs(r) + kChance / std::sqrt(samples));
  }
  return std::min(1.0, most);
}

bool LockedSignals::chatters(double inertia) const {
  double torque = 0, n = 0;
  std::vector<double> speeds;
  for (std::size_t k = 0; k < counts_.size(); ++k) {
    if (!counts_[k]) continue;
    torque += fast_torque_[k] * fast_torque_[k];
    speeds.push_back(data_.motor_rate[k]);
    ++n;
  }
  const double kick = std::sqrt(torque / n) * data_.interval / inertia;
  if (kick < kTurns * signal::median_magnitude(speeds)) return false;
  return answer() > (kBeyondChance + kChance) / std::sqrt(n);
}

Eigen::VectorXd LockedSignals::delayed_by_sample() const {
  std::vector<double> change = signal::derivative(data_.torque, 1);
  for (double& value : change) value = -value;
  return low_passed(std::move(change));
}

std::vector<double> LockedSignals::raw_mesh_torque(const model::Rig& rig, const LockedMesh& mesh) const {
  model::ContactSpec spec = rig.mesh.contact_spec();
  spec.values["stiffness"] = mesh.stiffness;
  const auto law = model::make_contact_law(spec.law, spec.values);
  const double lever = rig.mesh.lever(), middle = this->middle();
  // Of a law that needs the speed of a touch the elastic part counts.
  const double rates = law->needs_impact_speed() ? 0 : lever;
  std::vector<double> torque(data_.size(), 0.0);
  for (std::size_t k = 0; k < torque.size(); ++k) {
    if (direction_[k] == 0) continue;
    const double x = position_[k] - mesh.drift * (double(k) * data_.interval - middle),
                 rate = rates * data_.motor_rate[k];
    if (x > mesh.plus) torque[k] += lever * law->force(lever * (x - mesh.plus), rate, 0);
    if (x < mesh.minus) torque[k] -= lever * law->force(lever * (mesh.minus - x), -rate, 0);
  }
  return torque;
}

Eigen::VectorXd LockedSignals::mesh_torque(const model::Rig& rig, const LockedMesh& mesh) const {
  return low_passed(raw_mesh_torque(rig, mesh));
}

std::string lack_name(Lack lack) {
  switch (lack) {
    case Lack::load_friction:
      return "friction that follows the load";
    case Lack::hardening:
      return "a stiffness that follows the load";
    case Lack::slow_friction:
      return "friction that changes at low speed";
    default:
      return "a delay between torque and position";
  }
}

Eigen::VectorXd LockedSignals::lack(Lack lack, const model::Rig& rig, const LockedMesh& mesh) const {
  if (lack == Lack::delay) return delayed_by_sample();
  std::vector<double> torque = raw_mesh_torque(rig, mesh);
  for (std::size_t k = 0; k < torque.size(); ++k) {
    const double load = std::fabs(torque[k]), way = double(direction_[k]);
    if (lack == Lack::load_friction)
      torque[k] = way * load;
    else if (lack == Lack::hardening)
      torque[k] *= load;
    else
      torque[k] = way * std::exp(-std::fabs(data_.motor_rate[k]) / usual_speed_);
  }
  return low_passed(std::move(torque));
}

Eigen::VectorXd LockedSignals::picked(const Eigen::VectorXd& values) const {
  Eigen::VectorXd out(rows_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i) out[Eigen::Index(i)] = values[rows_[i]];
  return out;
}

Eigen::MatrixXd LockedSignals::picked(const Eigen::MatrixXd& values) const {
  Eigen::MatrixXd out(rows_.size(), values.cols());
  for (std::size_t i = 0; i < rows_.size(); ++i) out.row(Eigen::Index(i)) = values.row(rows_[i]);
  return out;
}

}  // namespace backlash::identification
