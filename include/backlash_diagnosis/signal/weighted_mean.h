// SPDX-License-Identifier: BSD-3-Clause
// The mean of several measurements of one quantity, weighted by their standard errors.
#pragma once

#include <vector>

#include "backlash_diagnosis/signal/measured.h"

namespace backlash::signal {

struct WeightedMean : Measured {
  double chance =
      1;  // probability of a chi^2 as large or larger if the stated errors are right; 1 for a single value
};

/// Mean weighted by the inverse squares of the standard errors, which must be > 0. If the values differ by
/// more than the errors allow, chi^2 > n - 1, its standard error is multiplied by sqrt(chi^2 / (n - 1))
/// (Particle Data Group, Review of Particle Physics, 2022, Section 5.2.2). Needs at least one value.
WeightedMean weighted_mean(const std::vector<Measured>& values);

}  // namespace backlash::signal
