// SPDX-License-Identifier: BSD-3-Clause
// The mean of several measurements of one quantity, of which some may be wrong.
#pragma once

#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::signal {

struct RobustMean : Measured {
  std::vector<std::size_t> outliers;  // values beyond three standard deviations
};

/// Huber's location (fit_robust) of values with standard errors s_i >= 0. The weight of a value is that of
/// the error sqrt(s_i^2 + median(s)^2), so that a very small stated error does not let one value determine
/// the mean. The standard error follows from the scatter of the values, and is never below what the s_i give.
/// If one s_i is NaN, all weights are equal. A single value is returned as it is. Throws CannotIdentify
/// without values.
RobustMean robust_mean(const std::vector<Measured>& values);

}  // namespace backlash::signal
