// SPDX-License-Identifier: BSD-3-Clause
// A parabola through a sample and `reach` samples to each side of it, by least squares (Savitzky and Golay
// 1964).
#pragma once

#include <cstddef>
#include <vector>

namespace backlash::signal {

/// Weights of the 2 reach + 1 samples. `reach` >= 1.
struct LocalParabola {
  std::size_t reach;
  std::vector<double> value;  ///< of the parabola at the middle sample
  std::vector<double> slope;  ///< per sample

  explicit LocalParabola(std::size_t to_each_side) : reach(to_each_side) {
    const auto m = static_cast<double>(reach);
    for (double k = -m; k <= m; ++k) {
      value.push_back((3 * (3 * m * m + 3 * m - 1) - 15 * k * k) / ((2 * m - 1) * (2 * m + 1) * (2 * m + 3)));
      slope.push_back(3 * k / (m * (m + 1) * (2 * m + 1)));
    }
  }

  /// Sum of the samples about `i`, from i - reach to i + reach, which must be there, times `weights`.
  double of(const std::vector<double>& x, std::size_t i, const std::vector<double>& weights) const {
    double sum = 0;
    for (std::size_t k = 0; k < weights.size(); ++k) sum += weights[k] * x[i + k - reach];
    return sum;
  }
};

}  // namespace backlash::signal
