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
/// from the first, as is likeliest with jitter of the size that they show and one sample of 200 lost: a long
/// interval has lost samples in it where those behind it stay behind, and samples that come late in one burst
/// have the rows of when they were taken.
std::vector<std::size_t> rows_of_samples(const std::vector<double>& time, double interval);

/// When samples were taken.
struct SamplingTimes {
  std::vector<double> time;  ///< s
  double stamped = 0;        ///< 0 to 1, how much of what a stamp is off an even base its sample was, too
  double unsure = 0;         ///< s, standard deviation of what remains unknown of a time
};

/// Samples are taken late, or stamped late, or both. A position shows which: its sample is off by the rate
/// times what it was late. Taken as the mean that this leaves, between an even base (the stamps alone jitter)
/// and the stamps. Where Record::unsure_time is known the times of the record are these.
/// What spans a cut [s] shows nothing.
SamplingTimes sampling_times(const Record& record, const std::vector<Stretch>& cuts = {});

/// A record that is even to a thousandth of an interval is returned as it is, with rows for lost samples.
/// Others are interpolated between sampling_times(); Record::unsure_time is what is unknown of them. A record
/// of which more than half would be lost is returned as it is.
EvenGrid even_grid(const Record& record);

}  // namespace backlash::record
