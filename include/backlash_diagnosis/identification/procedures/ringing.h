// SPDX-License-Identifier: BSD-3-Clause
// One stretch of ringing: a damped sine about a straight line, from raw samples and from its peaks.
//   y(t) = c0 + c1 t + exp(-a t) (p cos(wd t) + q sin(wd t)),  a = z w0,  wd = w0 sqrt(1 - z^2)
#pragma once

#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::identification {

struct Ringing {
  std::vector<double> time, measured, fitted;         // s, unit of the signal
  double level = 0, slope = 0;                        // c0, c1 [1/s], t from the first sample
  double amplitude = 0, deviation = 0;                // largest excursion of the sine; of the residuals
  signal::Measured rate, frequency;                   // a [1/s], wd [rad/s]
  signal::Measured damping_ratio, natural_frequency;  // z [-], w0 [rad/s]
  /// Extremes measured from the line c0 + c1 t, in turn above and below, and the damping ratio they give; NaN
  /// with fewer than three.
  std::vector<double> peak_time, peak;
  double peak_damping_ratio = std::numeric_limits<double>::quiet_NaN();
};

/// Least squares over a and wd, the linear coefficients eliminated (variable projection, Golub and Pereyra
/// 1973). `expected` [rad/s]: w0 is sought from half to twice that, z from 0 to 0.9. Standard errors for
/// independent noise. Throws CannotIdentify with fewer than 10 samples or no such ringing.
Ringing fit_ringing(const std::vector<double>& time, const std::vector<double>& values, double expected);

/// Fills the peaks of a fitted stretch as Yumrukcal (2013, Eqs. 5.6 to 5.9): |extreme| = B exp(tau t), half a
/// period between extremes, A = -tau / wd, z = sqrt(A^2 / (1 + A^2)). Extremes below three deviations are
/// noise and left out.
void measure_peaks(Ringing& ringing);

}  // namespace backlash::identification
