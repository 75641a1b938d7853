// SPDX-License-Identifier: BSD-3-Clause
// Correlation of successive values, and how much larger it makes the standard error of a line: temperature
// and load come and go slowly, and errors that hang together look like a trend.
#pragma once

#include <vector>

namespace backlash::signal {

/// Variances with the errors as they are over those with independent errors of the same size.
struct ErrorMemory {
  double slope = 1, level = 1;
};

/// `residuals` of a line at rising `times`, at least 5, with outliers clipped.
///
/// The errors are taken as an independent part and one that forgets exponentially (a first-order
/// autoregression in continuous time; for uneven spacing as Robinson 1977 and Mudelsee 2002). Share and time
/// constant come from the restricted likelihood (Patterson and Thompson 1971: the plain one makes errors
/// about a fitted line look more independent than they are), by a Kalman filter (Jones 1981). A few points
/// hardly determine them: the variances are averaged over a grid of both by their likelihood. The variance of
/// Kendall's statistic grows as in Hamed and Rao (1998), with Pearson's in place of the rank correlation,
/// which is at most 2 % smaller.
ErrorMemory error_memory(const std::vector<double>& times, const std::vector<double>& residuals);

}  // namespace backlash::signal
