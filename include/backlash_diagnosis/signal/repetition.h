// SPDX-License-Identifier: BSD-3-Clause
// Whether a signal repeats itself, and what differs from one time to the next.
//
// Of a machine that makes the same motion again, half of the mean square of
//   r(t + P) - r(t)
// is the noise of r, whatever law the part that repeats follows: the pure error of repeated runs (Draper and
// Smith 1998, section 2.1).
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace backlash::signal {

/// The lag P [samples] after which a position comes back best: root mean square of q(t + P) - q(t) at most
/// `most` of its standard deviation, and the same of its first differences at most ten times `most` of
/// theirs. At least a fifth of the signal is compared, and P is longer than the signal takes to become unlike
/// itself. Nothing where it does not repeat.
std::optional<std::size_t> repetition(const std::vector<double>& position, double most = 0.003);

/// Standard deviation of what differs between `lag` samples, divided by sqrt(2), of pairs that both count. 0
/// where fewer than 100 do.
double repeated_noise(const std::vector<double>& values, const std::vector<char>& counts, std::size_t lag);

}  // namespace backlash::signal
