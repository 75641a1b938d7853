// SPDX-License-Identifier: BSD-3-Clause
// Means of two runs over cells of the load's position, and the columns that waves of the gap have in them.
#pragma once

#include <Eigen/Core>

#include "backlash_diagnosis/identification/procedures/gap_waves.h"

namespace backlash::identification {

/// What is fitted: the separation of the flanks over places that both runs visited, or each run over its own
/// places, where `apart`.
struct GapCells {
  Eigen::VectorXd place, value;  // rad
  Eigen::VectorXd share;         // -, of the gap in the value: 1, or half with the sign of the run
  bool apart = false;
  double width = 0;  // rad
  double turns = 0;  // of the load, of either run where apart
  double freedom() const { return double(value.size()); }
};

/// Over the places that both runs visited in cells of this width [rad].
GapCells shared_cells(const GapRun& forward, const GapRun& reverse, double width);

/// Each run over its own places.
GapCells separate_cells(const GapRun& forward, const GapRun& reverse, double width);

/// Columns of one wave: of the gap, and of the centre line where that does not cancel; sine and cosine.
Eigen::Index columns_per_wave(const GapCells& cells);

/// Into the columns of `a` from `column` on.
void put_wave(const GapCells& cells, double order, Eigen::MatrixXd& a, Eigen::Index column);

/// Without the waves: mean and whole orders; of runs apart with the scale of the motor, each for itself.
Eigen::MatrixXd base_columns(const GapCells& cells, int whole);

}  // namespace backlash::identification
