// SPDX-License-Identifier: BSD-3-Clause
// Spectra of evenly sampled signals: Fourier transform, Welch's averages, coherence, and products of a signal
// with itself later.
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace backlash::signal {

/// X[k] = sum over n of x[n] exp(-j 2 pi k n / N), k = 0 ... N/2. Fast where N has small prime factors.
std::vector<std::complex<double>> fourier_transform(const std::vector<double>& x);

/// r[l] = sum over n of x[n] x[n + l], l = 0 ... `lags` < number of values, by way of the spectrum.
std::vector<double> lagged_products(const std::vector<double>& x, std::size_t lags);

/// By how much the variance of a mean of `values` exceeds that of as many independent ones [samples]:
/// 1 + 2 sum of r[l] / r[0] over the lags up to the first with less than 5 %, at most a quarter of the
/// values. The values are taken about 0. 1 where all are 0.
double correlation_length(const std::vector<double>& values);

/// Variance of a number fitted over many lines of a spectrum with Hann windows, over that with independent
/// lines: neighbours correlate by 2/3 and 1/6, in power by the squares.
constexpr double kHannLines = 1 + 2 * (4.0 / 9 + 1.0 / 36);

/// Averages of the spectra of x and y by Welch's method (1967): Hann windows, half overlapping, the mean
/// taken off each. Line k is at k / (segment * interval) [Hz], k = 0 ... segment/2 - 1; line 0 says nothing.
struct WelchSpectra {
  std::vector<double> xx, yy;            ///< one-sided power densities, squares of the units per Hz
  std::vector<std::complex<double>> xy;  ///< conj(X) Y, so that the response of y to x is xy / xx
  /// Independent segments that these are worth: K / (1 + 2/36), since windows that overlap by half correlate
  /// by 1/6.
  double averages = 0;

  /// |Sxy|^2 / (Sxx Syy), 0 to 1, not corrected for its bias; 0 where one signal has no power.
  double coherence(std::size_t line) const;
};

/// Throws InvalidParameter for a `segment` [samples] that is odd or below 8 or does not fit twice,
/// overlapping; for an interval [s] <= 0, and signals of different length.
WelchSpectra welch(const std::vector<double>& x, const std::vector<double>& y, double interval,
                   std::size_t segment);

}  // namespace backlash::signal
