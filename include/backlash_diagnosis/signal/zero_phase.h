// SPDX-License-Identifier: BSD-3-Clause
// Filters without delay, for evenly sampled signals that are known as a whole: forward, then backward.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace backlash::signal {

/// Butterworth low-pass of order 4, forward and backward: gain 1 / (1 + (tan(pi f T) / tan(pi f_c T))^8), no
/// phase shift, half of the amplitude at the cutoff f_c [Hz]. `interval` T [s]. Before the first and after
/// the last value the signal is continued by point reflection about it, over three time constants of the
/// filter. Throws InvalidParameter for an interval <= 0 and a cutoff outside 0 < f_c < 0.5 / T.
std::vector<double> low_pass(const std::vector<double>& values, double interval, double cutoff);

/// The same for each column, in place; faster for many columns than one by one.
void low_pass_columns(Eigen::Ref<Eigen::MatrixXd> columns, double interval, double cutoff);

/// Central difference [unit / s]; at the ends the parabola through the last three. Error h^2 / 6 times the
/// third derivative, zero phase. Throws InvalidParameter for fewer than three values.
std::vector<double> derivative(const std::vector<double>& values, double interval);

/// The signal delayed by `samples` (also fractions, also < 0): y[k] = x(k - samples), cubic between samples
/// (Catmull-Rom); beyond the ends the first or last value.
std::vector<double> delayed(const std::vector<double>& values, double samples);

}  // namespace backlash::signal
