// SPDX-License-Identifier: BSD-3-Clause
// A quantity that repeats every turn as a short series: y = mean + sum A_n sin(n angle + phi_n), with only
// those orders that the values call for.
#pragma once

#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct Harmonic {
  int order;
  signal::Measured amplitude, phase;  // of sin(order angle + phase): unit of the values, rad
  double chance;                      // of so much or more by noise alone, all orders considered
};

struct HarmonicSeries {
  signal::Measured mean;
  std::vector<Harmonic> harmonics;  // by order
  double deviation = 0;             // of the residuals
  double chance = 1;                // of the strongest order, taken or not
};

/// Least squares with equal weights. Orders are taken one after the other, the one that explains most first,
/// while an F-test (2 parameters; Bonferroni over the orders left) gives it less than `false_alarm`. The
/// values' errors must be independent. Throws CannotIdentify as fit_linear().
HarmonicSeries fit_harmonics(const std::vector<double>& angle, const std::vector<double>& values,
                             const std::vector<int>& orders, double false_alarm);

}  // namespace backlash::identification
