// SPDX-License-Identifier: BSD-3-Clause
// What only the errors of a machine with a locked link count.
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/identification/fit/noise_floor.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "joint_fit.h"

namespace backlash::identification {
namespace {

constexpr double kBetweenHolds = 0.5;  // theory: samples, between a torque that is held and one of the moment
constexpr double kUnsureOfNoise = 0.3;  // choice: of what noise of the motion makes of a value

}  // namespace

void correct_for_noise_of_motion(MachineFit& fit, const Machine& start, const RecordSet& records) {
  const Eigen::MatrixXd& j = fit.fit.jacobian;
  const Eigen::MatrixXd gain = signal::symmetric_inverse(signal::gram(j));
  const Unknowns unknowns(start);
  Eigen::VectorXd bias = Eigen::VectorXd::Zero(fit.fit.values.size());
  for (std::size_t i = 0; i < start.parameters.size(); ++i) {
    const rig_file::RigParameter& p = rig_file::servo_parameter(start.parameters[i].name);
    const bool inertia = p.kind == rig_file::ParameterKind::inertia;
    if (p.part != rig_file::RigPart::motor ||
        !(inertia || p.kind == rig_file::ParameterKind::viscous_friction))
      continue;
    double squares = 0;  // that the noise adds to those of the value's column
    for (std::size_t r = 0; r < records.records().size(); ++r) {
      const PreparedServo& record = records.records()[r];
      const double w = 2 * M_PI * record.cutoff, white = record_noise(record.data()).motor,
                   speed = std::min(w * std::sqrt(2 * record.cutoff * record.data().interval / 3) * white,
                                    record.data().rate_noise),
                   noise = inertia ? speed * w * std::sqrt(0.6) : speed;
      const double rows = double(
          std::count_if(records.layout().begin(), records.layout().end(), [&](const RecordSet::Row& row) {
            return row.record == r && !row.deflection && record.counts[row.sample];
          }));
      squares += rows * std::pow(noise * p.get(fit.machine.rig) / records.weights()[r].torque, 2);
    }
    bias -= squares * gain.col(Eigen::Index(i));
  }
  fit.fit.values -= bias;
  fit.machine = unknowns.machine(fit.fit.values);
  fit.fit.covariance += std::pow(kUnsureOfNoise, 2) * bias * bias.transpose();
}

void allow_for_hold(MachineFit& fit, const Machine& start) {
  const Unknowns unknowns(start);
  const Eigen::MatrixXd covariance = fit.fit.covariance;
  for (std::size_t r = 0; r < start.calibrations.size(); ++r)
    if (const auto delay = unknowns.delay(r)) {
      const Eigen::VectorXd shift = covariance.col(*delay) * (kBetweenHolds / covariance(*delay, *delay));
      fit.fit.covariance += shift * shift.transpose();
    }
}

}  // namespace backlash::identification
