// SPDX-License-Identifier: BSD-3-Clause
// One number from several measurements of it, each with an error that is believed.
#pragma once

#include <vector>

#include "backlash_diagnosis/signal/measured.h"

namespace backlash::signal {

struct WeightedMean : Measured {
  double chance = 1;  // of values that differ by as much where the errors are right; 1 for a single value
};

/// Mean by the inverse squares of the errors, which are > 0. Where the values differ by more than these allow
/// its error is larger, by the factor sqrt(chi^2 / (n - 1)) (Particle Data Group, Review of Particle Physics,
/// 2022, Section 5.2.2). Needs a value.
WeightedMean weighted_mean(const std::vector<Measured>& values);

}  // namespace backlash::signal
