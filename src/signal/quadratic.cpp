// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/quadratic.h"

#include <algorithm>
#include <cmath>

namespace backlash::signal {

std::vector<std::pair<double, double>> quadratic_at_most_zero(double a, double b, double c) {
  std::vector<double> cuts = {0, 1};
  const double root = std::sqrt(b * b - 4 * a * c);  // NaN: no roots
  const double q = -0.5 * (b + std::copysign(root, b));
  for (const double x : {q / a, c / q})
    if (x > 0 && x < 1) cuts.push_back(x);
  std::sort(cuts.begin(), cuts.end());
  std::vector<std::pair<double, double>> intervals;
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double middle = 0.5 * (cuts[i] + cuts[i + 1]);
    if (!((a * middle + b) * middle + c <= 0)) continue;
    if (!intervals.empty() && intervals.back().second == cuts[i])
      intervals.back().second = cuts[i + 1];
    else
      intervals.emplace_back(cuts[i], cuts[i + 1]);
  }
  return intervals;
}

}  // namespace backlash::signal
