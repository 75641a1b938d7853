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
  /// `left` is of `fit`; all must outlive it.
  ResidualOrders(const MachineFit& fit, const RecordSet& records, const OrthogonalPart& left);

  /// Of the residual, with the machine's own parameters fitted at the same time.
  signal::OrderSpectrum spectrum(const model::WaveOver& wave, const ParameterValues& choices) const;

 private:
  struct Row {
    bool deflection, counts;
    double cutoff;  // Hz
    model::Motion motion;
  };
  const OrthogonalPart& left_;
  std::vector<Row> rows_;
};

}  // namespace backlash::identification
