// SPDX-License-Identifier: BSD-3-Clause
// The even rows on which the samples of a record stand.
#pragma once

#include <optional>
#include <vector>

#include "backlash_diagnosis/record/even_grid.h"

namespace backlash::record {

constexpr double kEven =
    1e-3;  // of an interval, off which a stamp moves no sample: choice, far below any jitter
constexpr std::size_t kOfCubic = 4;  // theory: samples of a cubic
// Rows of a gap, behind which the clock has any phase. Theory: as many as a clock is followed within.
constexpr std::size_t kForgotten = 10;

struct SampleGrid {
  std::vector<double> time;      // s, of the rows
  std::vector<bool> lost;        // of each row
  std::vector<std::size_t> row;  // of each sample: the nearest
  double off = 0;                // intervals, largest distance of a sample from its row
};

/// Samples count on from one another: a clock that drifts against the median interval does not add up. The
/// rows are a line through the stamps, of one slope, that begins anew behind a gap in which its phase was
/// forgotten. Nothing where more than half of the rows would be lost.
std::optional<SampleGrid> grid_of(const std::vector<double>& time, double median);

/// Samples taken at `time`, at the rows of the grid.
std::vector<double> at_rows(const SampleGrid& g, const std::vector<double>& time,
                            const std::vector<double>& y, bool cubic);

}  // namespace backlash::record
