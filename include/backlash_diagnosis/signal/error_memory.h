// SPDX-License-Identifier: BSD-3-Clause
// Correlation of successive errors, and how much it enlarges the variance of a fitted line. Temperature and
// load change slowly, and correlated errors look like a trend.
#pragma once

#include <vector>

namespace backlash::signal {

/// Variance with the errors as they are, over that with independent errors of the same size: of the line's
/// slope and of its mean level.
struct ErrorMemory {
  double slope = 1, level = 1;
};

/// `residuals` of a line at increasing `times` [any unit], at least 5, with outliers clipped.
///
/// Model: an independent error plus a first-order autoregression in continuous time, correlation exp(-|dt| /
/// tau) (for uneven spacing: Robinson 1977, Mudelsee 2002). Their shares and tau have a restricted likelihood
/// (Patterson and Thompson 1971), as the plain likelihood underestimates the correlation of residuals of a
/// fitted line; it is computed by a Kalman filter (Jones 1981). A few points hardly determine both, so the
/// result is the mean over a grid of shares and tau, weighted by likelihood. The variance of Kendall's
/// statistic grows as in Hamed and Rao (1998), with Pearson's in place of the rank correlation, which is at
/// most 2 % smaller.
ErrorMemory error_memory(const std::vector<double>& times, const std::vector<double>& residuals);

}  // namespace backlash::signal
