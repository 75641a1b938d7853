// SPDX-License-Identifier: BSD-3-Clause
// Distributions that tests and intervals rest on. From Boost.Math, whose templates are compiled once, here.
#pragma once

namespace backlash::signal {

/// 97.5 % quantile of the standard normal distribution: half of a 95 % interval in standard deviations.
constexpr double kNormalQuantile975 = 1.959963984540054;

/// t such that P(T <= t) = `probability` (0, 1); `degrees` of freedom > 0. Throws InvalidParameter.
double student_t_quantile(double probability, double degrees);

/// P(|T| > |t|), by chance alone; `degrees` of freedom > 0. Throws InvalidParameter.
double student_t_two_sided(double t, double degrees);

/// x such that P(X <= x) = `probability` (0, 1); `degrees` of freedom > 0. Throws InvalidParameter.
double chi_square_quantile(double probability, double degrees);

/// P(X <= x), x >= 0; `degrees` of freedom > 0. Throws InvalidParameter.
double chi_square_probability(double x, double degrees);

}  // namespace backlash::signal
