// SPDX-License-Identifier: BSD-3-Clause
#include "residual_orders.h"

#include <cmath>
#include <limits>

namespace backlash::identification {
namespace {

constexpr double kPasses = 0.8;  // theory: of the cutoff, where the low-pass still passes 0.86
constexpr double kLargest =
    4000;  // choice (time): 1/rad, more than the teeth of any stage per turn of the load

}  // namespace

double highest_order(double speed, double cutoff) {
  const double slowest = 2 * M_PI * cutoff / std::numeric_limits<float>::max();
  return kPasses * 2 * M_PI * cutoff / std::max(std::fabs(speed), slowest);
}

ResidualOrders orders_of_fit(const MachineFit& fit, const RecordSet& records, const OrthogonalPart& left) {
  std::vector<ResidualOrders::Row> rows;
  std::vector<ServoResiduals> of;
  for (std::size_t i = 0; i < records.records().size(); ++i)
    of.push_back(records.records()[i].residuals(fit.machine.rig, fit.machine.calibrations[i]));
  for (const RecordSet::Row& row : records.layout()) {
    const PreparedServo& record = records.records()[row.record];
    const ServoData& d = record.data();
    const ServoResiduals& r = of[row.record];
    const std::size_t k = row.sample;
    rows.push_back(
        {row.deflection,
         row.deflection ? !r.deflection.empty() && record.settled[k] : bool(record.counts[k]),
         record.cutoff,
         {row.time, d.motor[k], d.motor_rate[k], r.load->load[k], r.load->load_rate[k], r.mesh_torque[k]}});
  }
  return {std::move(rows), left.residuals(), left.basis()};
}

signal::OrderSpectrum ResidualOrders::spectrum(const model::WaveOver& wave,
                                               const ParameterValues& choices) const {
  signal::OrderSamples s;
  std::vector<Eigen::Index> places;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    if (row.deflection != wave.deflection || !row.counts) continue;
    const model::WaveMoment at = wave.at(row.motion, choices);
    places.push_back(Eigen::Index(i));
    s.value.push_back(residuals_[Eigen::Index(i)]);
    s.position.push_back(at.position);
    s.carrier.push_back(at.carrier);
    s.highest.push_back(highest_order(at.speed, row.cutoff));
  }
  Eigen::MatrixXd known(Eigen::Index(places.size()), known_.cols());
  for (std::size_t i = 0; i < places.size(); ++i) known.row(Eigen::Index(i)) = known_.row(places[i]);
  return signal::order_spectrum(s, kLargest, known);
}

}  // namespace backlash::identification
