// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

/// The record on an even time base of its own median interval, channels linear between samples. A record that
/// is even to 1 % of an interval is returned as it is. Throws BadData where less than four samples or a gap
/// of more than kGapFactor intervals make that meaningless.
Record evenly_sampled(const Record& record);

}  // namespace backlash::record
