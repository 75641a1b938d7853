// SPDX-License-Identifier: BSD-3-Clause
// How often per turn of the motor or the load the residuals of a fit repeat.
#pragma once

#include <vector>

#include "backlash_diagnosis/model/term.h"
#include "backlash_diagnosis/signal/order_spectrum.h"
#include "orthogonal_part.h"

namespace backlash::identification {

/// 1/rad: highest order that a sample at this speed [rad/s] shows behind a low-pass [Hz].
double highest_order(double speed, double cutoff);

class ResidualOrders {
 public:
  struct Row {
    bool deflection, counts;
    double cutoff;  // Hz
    model::Motion motion;
  };
  /// One residual per row, orthogonal to the columns of `known`, which are orthonormal.
  ResidualOrders(std::vector<Row> rows, Eigen::VectorXd residuals, Eigen::MatrixXd known)
      : rows_(std::move(rows)), residuals_(std::move(residuals)), known_(std::move(known)) {}

  /// Of the residual, with what is known fitted at the same time.
  signal::OrderSpectrum spectrum(const model::WaveOver& wave, const ParameterValues& choices) const;

 private:
  std::vector<Row> rows_;
  Eigen::VectorXd residuals_;
  Eigen::MatrixXd known_;
};

/// `left` is of `fit`.
ResidualOrders orders_of_fit(const MachineFit& fit, const RecordSet& records, const OrthogonalPart& left);

}  // namespace backlash::identification
