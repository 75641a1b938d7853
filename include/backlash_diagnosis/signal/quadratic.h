// SPDX-License-Identifier: BSD-3-Clause
// Quadratic inequalities, from which confidence intervals on a piecewise linear curve are computed.
#pragma once

#include <utility>
#include <vector>

namespace backlash::signal {

/// Solutions of a x^2 + b x + c <= 0 within [0, 1], as up to two intervals in increasing order.
std::vector<std::pair<double, double>> quadratic_at_most_zero(double a, double b, double c);

}  // namespace backlash::signal
