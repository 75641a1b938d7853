// SPDX-License-Identifier: BSD-3-Clause
// Whether a signal repeats itself, and what differs from one time to the next.
//
// If a machine makes the same motion again, half of the mean square of
//   r(t + P) - r(t)
// is the variance of the noise of r, whatever law the repeating part follows: the pure error of repeated runs
// (Draper and Smith 1998, section 2.1).
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace backlash::signal {

/// The lag P [samples] at which a position repeats best. Required: rms of q(t + P) - q(t) at most `most`
/// times the standard deviation of q, and the same for its first differences with ten times `most`. At least
/// a fifth of the signal is compared. Lags are searched from where rms of q(t + P) - q(t) first exceeds the
/// standard deviation of q. Nothing if the position does not repeat, or has fewer than 100 samples.
std::optional<std::size_t> repetition(const std::vector<double>& position, double most = 0.003);

/// Standard deviation of values[k + lag] - values[k], divided by sqrt(2), over the pairs of which both
/// `counts` are not 0. 0 for fewer than 100 pairs.
double repeated_noise(const std::vector<double>& values, const std::vector<char>& counts, std::size_t lag);

}  // namespace backlash::signal
