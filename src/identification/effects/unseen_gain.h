// SPDX-License-Identifier: BSD-3-Clause
// By how much a model reduces the error on the unseen record, with an interval.
#pragma once

#include <vector>

#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "backlash_diagnosis/identification/fit/output_error.h"
#include "search_settings.h"

namespace backlash::identification {

/// The residual of one channel at the samples that count: sum of squares per block of the record, and the
/// part of their sum that noise alone would leave.
struct Left {
  std::vector<double> square;
  double noise = 0;
  double total() const;
};

Left left(const ServoPrediction& prediction, bool deflection, const BeliefSettings& settings);

/// 1 - sqrt(after / before), and of blocks drawn with replacement (bootstrap).
TestGain test_gain(const Left& before, const Left& after, const BeliefSettings& settings);

}  // namespace backlash::identification
