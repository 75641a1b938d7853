// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "backlash_diagnosis/record/even_grid.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

/// The record on an even time base of its own median interval: positions by a cubic between samples, all else
/// on the line. A record that is even to 1 % of an interval is returned as it is. Throws BadData where less
/// than four samples or a gap of more than kGapFactor intervals make that meaningless.
Record evenly_sampled(const Record& record);

/// The same with the rows that were not recorded, for those who leave them out; gaps up to kLongestFilled.
EvenGrid evenly_sampled_grid(const Record& record);
constexpr double kLongestFilled = 50;  ///< intervals; choice

/// A record between its gaps of more than kLongestFilled intervals: each part a record of its own, with its
/// start in its name; what is shorter than a tenth of the longest is left out, which the first one's warnings
/// say.
std::vector<Record> parts_between_gaps(Record record);

/// The same at a longer interval [s], torques and speeds low-passed below half its rate. Throws
/// InvalidParameter where it is shorter than the record's own.
EvenGrid resampled(const Record& record, double interval);

}  // namespace backlash::record
