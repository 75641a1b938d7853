// SPDX-License-Identifier: BSD-3-Clause
#include "locked_signals.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "../fit/servo_prediction.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::identification {
namespace {

constexpr double kOversampling = 1.25;      // theory: rows per second over 2 cutoff
constexpr double kLeastShare = 0.02;        // choice: of the samples, that slide in each direction
constexpr std::size_t kFewestRows = 64;     // choice
constexpr std::size_t kFewestSamples = 64;  // theory: for the noise of a position (bandwidth.h)

/// The rig without what the columns and the mesh do not say.
model::Rig plain(model::Rig rig) {
  rig.terms.clear();
  rig.motor.viscous_asymmetry = 0;
  return rig;
}

}  // namespace

LockedSignals::LockedSignals(const record::Record& record, const model::Rig& rig) {
  if (record.size() < kFewestSamples)
    throw CannotIdentify(fmt::format("{}: only {} samples", record.name, record.size()));
  data_ = servo_data(record, rig);
  data_.load.clear();
  cutoff_ = with_bands({}, rig, {data_}).cutoff;
  const PreparedServo prepared(data_, cutoff_, 0);
  direction_ = prepared.direction;
  counts_ = prepared.counts;
  const auto stride = std::max(1L, std::lround(1 / (2 * kOversampling * cutoff_ * data_.interval)));
  long forward = 0, backward = 0;
  for (long k = 0; k < long(data_.size()); ++k) {
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

Eigen::VectorXd LockedSignals::delayed_by_sample() const {
  std::vector<double> change = signal::derivative(data_.torque, 1);
  for (double& value : change) value = -value;
  return low_passed(std::move(change));
}

Eigen::VectorXd LockedSignals::mesh_torque(const model::Rig& rig, const LockedMesh& mesh) const {
  model::ContactSpec spec = rig.mesh.contact_spec();
  spec.values["stiffness"] = mesh.stiffness;
  const auto law = model::make_contact_law(spec.law, spec.values);
  const double lever = rig.mesh.lever(), middle = this->middle();
  // Of a law that needs the speed of a touch the elastic part counts.
  const double rates = law->needs_impact_speed() ? 0 : lever;
  std::vector<double> torque(data_.size(), 0.0);
  for (std::size_t k = 0; k < torque.size(); ++k) {
    if (direction_[k] == 0) continue;
    const double x = data_.motor[k] - mesh.drift * (double(k) * data_.interval - middle),
                 rate = rates * data_.motor_rate[k];
    if (x > mesh.plus) torque[k] += lever * law->force(lever * (x - mesh.plus), rate, 0);
    if (x < mesh.minus) torque[k] -= lever * law->force(lever * (mesh.minus - x), -rate, 0);
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
