// SPDX-License-Identifier: BSD-3-Clause
// Quadratic inequalities, of which intervals on a curve with straight pieces consist.
#pragma once

#include <utility>
#include <vector>

namespace backlash {

/// Solutions of a x^2 + b x + c <= 0 within [0, 1], as up to two intervals in increasing order.
std::vector<std::pair<double, double>> not_positive(double a, double b, double c);

}  // namespace backlash
