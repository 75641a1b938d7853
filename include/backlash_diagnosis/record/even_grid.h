// SPDX-License-Identifier: BSD-3-Clause
// A record on an even time base: lost samples get their rows back, and samples that were taken early or late
// are interpolated, so that methods that count samples see the time that passed.
#pragma once

#include <vector>

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

/// A position goes on as it was; a torque may jump.
bool is_smooth(Channel channel);

/// Between samples `j` and the next the line, or Lagrange's cubic through the two to either side.
double interpolated(const std::vector<double>& time, const std::vector<double>& values, std::size_t j,
                    double t, bool cubic);

struct EvenGrid {
  Record record;           ///< positions by a cubic between samples, all else on the line
  std::vector<bool> lost;  ///< of each row: no sample was recorded within half an interval

  /// How many of `rows` rows from `first` on were recorded; and whether all were.
  std::size_t count(std::size_t first, std::size_t rows) const;
  bool whole(std::size_t first, std::size_t rows) const { return count(first, rows) == rows; }
};

/// Rows of an even base of this interval [s] on which samples with these increasing times [s] stand, counted
/// from the first. A long interval has lost samples in it where several samples on both sides of it are apart
/// by more: one that is late is followed by a short one, and jitter of a quarter of an interval averages out.
std::vector<std::size_t> rows_of_samples(const std::vector<double>& time, double interval);

/// A record that is even to a thousandth of an interval is returned as it is, with rows for lost samples. Of
/// others the positions say which is even, the sampling or the stamps: where they go on more smoothly at the
/// stamps, they were taken then, and are interpolated; else the stamps jitter, and even ones take their
/// place. A record of which more than half would be lost is returned as it is.
EvenGrid even_grid(const Record& record);

/// When the samples were taken, for methods that take each at its own time: as even_grid() decides, at the
/// stamps or evenly, with lost samples between them.
std::vector<double> sampling_times(const Record& record);

}  // namespace backlash::record
