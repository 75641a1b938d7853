// SPDX-License-Identifier: BSD-3-Clause
// White noise on a signal whose motion is unknown: from differences of successive values, or from successive
// periods of a signal that need not repeat exactly.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace backlash::signal {

/// Differences of `order`: 1 x[k+1] - x[k], 2 x[k+2] - 2 x[k+1] + x[k], and so on. Empty where the values are
/// too few.
std::vector<double> differences(std::vector<double> values, int order);

/// Standard deviation of white noise from differences of `order` >= 1. They cancel polynomials of a lower
/// degree, and nearly all of a slow motion. Their median magnitude is used, so rare jumps have no influence.
/// For white noise of variance 1 their variance is binomial(2 order, order): 2, 6, 20, 70 ... NaN for `order`
/// values or fewer.
double noise_from_differences(const std::vector<double>& values, int order);

/// Standard deviation of white noise. Both are the same if it could be measured; `lower` is 0 if there is
/// only an upper bound; `upper` is NaN if the signal is too short for either.
struct NoiseRange {
  double lower = 0, upper = std::numeric_limits<double>::quiet_NaN();
};

/// The smaller of two estimates, each from the calmest fifth of all stretches of 10 samples:
///   from period to period differences between successive periods. Exact if the motion repeats in a fifth of
///   the time. Otherwise the white part of the differences (smallest eigenvalue of their covariance,
///   Pisarenko 1973): an upper bound. within a period        residual of a cubic through the stretch: an
///   upper bound, close where the motion
///                          is slow compared with 10 samples.
/// `samples_per_period` is rounded. With fewer than two periods, or fewer than 10 samples in one, only the
/// second.
NoiseRange estimate_noise(const std::vector<double>& signal, double samples_per_period);

/// The range widened by two standard errors of an estimate from `samples` samples: a stretch of 10 gives
/// the standard deviation to about one half, see test_noise.cpp.
NoiseRange with_standard_error(const NoiseRange& range, std::size_t samples);

}  // namespace backlash::signal
