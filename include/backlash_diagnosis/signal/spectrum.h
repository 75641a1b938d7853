// SPDX-License-Identifier: BSD-3-Clause
// Spectra of evenly sampled signals: Fourier transform, autocorrelation, Welch's averaged spectra, coherence.
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace backlash::signal {

/// X[k] = sum over n of x[n] exp(-j 2 pi k n / N), k = 0 ... N/2. Fast where N has small prime factors.
std::vector<std::complex<double>> fourier_transform(const std::vector<double>& x);

/// Autocorrelation r[l] = sum over n of x[n] x[n + l], l = 0 ... `lags`, by Fourier transforms. Throws
/// InvalidParameter if `lags` is not below the number of values.
std::vector<double> lagged_products(const std::vector<double>& x, std::size_t lags);

/// The factor by which correlation enlarges the variance of the mean of `values`, [samples]: 1 + 2 sum of
/// r[l] / r[0] over the lags up to the first with less than 5 %, at most a quarter of the values. The values
/// must have the mean 0. 1 if all are 0.
double correlation_length(const std::vector<double>& values);

/// The factor by which a Hann window enlarges the variance of a number fitted to many lines of a spectrum:
/// lines at a distance of one and two correlate by 2/3 and 1/6, their powers by the squares of these.
constexpr double kHannLines = 1 + 2 * (4.0 / 9 + 1.0 / 36);

/// Averages of the spectra of x and y by Welch's method (1967): Hann windows, half overlapping, the mean
/// taken off each. Line k is at k / (segment * interval) [Hz], k = 0 ... segment/2 - 1; line 0 has no
/// meaning.
struct WelchSpectra {
  std::vector<double> xx, yy;            ///< one-sided power densities, squares of the units per Hz
  std::vector<std::complex<double>> xy;  ///< conj(X) Y, so that the response of y to x is xy / xx
  /// Equivalent number of independent segments: K / (1 + 2/36) of K segments, since Hann windows that overlap
  /// by half correlate by 1/6.
  double averages = 0;

  /// |Sxy|^2 / (Sxx Syy), 0 to 1, not corrected for its bias; 0 if one signal has no power.
  double coherence(std::size_t line) const;
};

/// Throws InvalidParameter for a `segment` [samples] that is odd or below 8 or does not fit twice,
/// overlapping; for an interval [s] <= 0, and signals of different length.
WelchSpectra welch(const std::vector<double>& x, const std::vector<double>& y, double interval,
                   std::size_t segment);

}  // namespace backlash::signal
