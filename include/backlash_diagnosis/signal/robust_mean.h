// SPDX-License-Identifier: BSD-3-Clause
// One number from several measurements of it, of which some may be wrong.
#pragma once

#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::signal {

struct RobustMean : Measured {
  std::vector<std::size_t> outliers;  // values beyond three standard deviations
};

/// Huber's location (fit_robust) of values with standard errors s_i >= 0; a value counts as if its error were
/// sqrt(s_i^2 + median(s)^2), so that a value with a very small stated error does not determine the mean
/// alone. The standard error is that of the scatter, but never below what the s_i allow. Where one is NaN all
/// count alike and the scatter decides. A single value is returned as it is. Throws CannotIdentify without
/// values.
RobustMean robust_mean(const std::vector<Measured>& values);

}  // namespace backlash::signal
