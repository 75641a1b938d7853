// One number from several measurements of it, of which some may be wrong.
#pragma once

#include <vector>

#include "backlash_diagnosis/identification/measured.h"

namespace backlash {

/// Huber's location (fit_robust) of values with standard errors s_i >= 0; a value counts as if its error were
/// sqrt(s_i^2 + median(s)^2), so that one which claims to be far better than the others does not rule alone.
/// The standard error is that of the scatter, but never below what the s_i allow. Throws CannotIdentify with
/// fewer than two values.
Measured robust_mean(const std::vector<Measured>& values);

}  // namespace backlash
