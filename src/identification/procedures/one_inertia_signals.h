// SPDX-License-Identifier: BSD-3-Clause
// What the equations of one inertia need of a record: filtered columns, and where the motor slides for sure.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/record/resampling.h"

namespace backlash::identification {

constexpr double kFewestPeriods = 20;  // choice: where half the band says another inertia

/// What the equations need of a record.
struct OneInertiaSignals {
  double interval = 0, cutoff = 0;                // s, Hz
  double position_noise = 0, position_error = 0;  // rad, white alone and with the rounding
  std::vector<double> time, torque,
      slides;  // torque as a second difference sees it; 1 where the motor slides for sure, else 0
  Eigen::MatrixXd columns;  // a, v, sign(v), 1 [, sin(q), cos(q)] where it slides, filtered; all samples
  std::vector<Eigen::Index> used;  // samples
};

/// Throws CannotIdentify where the record lacks a channel or is too short.
void require_torque_and_position(const record::Record& record);

/// A record on an even grid, with what is known of lost samples beside what its stamps show.
record::EvenGrid grid_with_losses(const record::Record& recorded, const std::vector<bool>& lost);

/// Filtered at `cutoff` [Hz], 0: as the motion asks for; `smoothed` [Hz]: as in OneInertia. Throws
/// InvalidParameter, CannotIdentify.
OneInertiaSignals one_inertia_signals(const record::EvenGrid& grid, double cutoff, bool gravity,
                                      double smoothed);

/// Samples at which the motor does not slide are set to 0 in all columns before the low-pass. As the equation
/// is linear, they then have no influence on the others.
std::vector<double> low_pass_sliding(const OneInertiaSignals& s, std::vector<double> x);

}  // namespace backlash::identification
