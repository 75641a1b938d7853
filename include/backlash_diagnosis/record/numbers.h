// SPDX-License-Identifier: BSD-3-Clause
// Rows that do not count: those without a number in a channel are samples that were lost.
#pragma once

#include <vector>

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

constexpr double kHardlyRecorded =
    0.1;  // choice: share of the rows with a number; with less a channel is absent

/// Takes out of records on one time base the channels that are hardly recorded, and then the rows in which
/// another has no number. Where no row would be left the records stay as they are.
void keep_rows_with_numbers(const std::vector<Record*>& records);

/// Of all columns the marked rows.
void keep_rows(Record& record, const std::vector<bool>& rows);

}  // namespace backlash::record
