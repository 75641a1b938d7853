// SPDX-License-Identifier: BSD-3-Clause
// Lost samples get their rows back, so that methods that count samples see the time that passed.
#pragma once

#include <vector>

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

/// A position goes on as it was; a torque may jump.
bool is_smooth(Channel channel);

struct EvenGrid {
  Record record;           ///< with a row for each lost sample: positions by a cubic, all else on the line
  std::vector<bool> lost;  ///< of each row: it was not recorded

  /// How many of `rows` rows from `first` on were recorded; and whether all were.
  std::size_t count(std::size_t first, std::size_t rows) const;
  bool whole(std::size_t first, std::size_t rows) const { return count(first, rows) == rows; }
};

/// Where an interval is a whole number of sampling intervals, to a quarter of one, the rows between are lost;
/// other intervals stay as they are. A record of which more than half would be lost is returned as it is.
EvenGrid even_grid(const Record& record);

}  // namespace backlash::record
