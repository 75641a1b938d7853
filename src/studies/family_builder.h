// SPDX-License-Identifier: BSD-3-Clause
// Builds the family of distributions of a curve and calibrates how a record is compared with it.
#pragma once

#include "backlash_diagnosis/diagnosis/apd_family.h"
#include "fine_run.h"

namespace backlash::studies {

/// Members of one backlash value, one per phase, free of noise.
std::vector<diagnosis::Quantiles> family_members(const CurvePlan& plan, const FineRun& run);

/// Fills the segments of a family whose members are there: `between[i]` is a run with the backlash in the
/// middle of segment i, which the family does not know.
void calibrate_family(const CurvePlan& plan, const std::vector<FineRun>& between, Ticker& ticker,
                      diagnosis::ApdFamily& family);

}  // namespace backlash::studies
