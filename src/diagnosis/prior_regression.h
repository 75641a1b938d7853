// SPDX-License-Identifier: BSD-3-Clause
// Least squares of rows with few columns each, with priors, Cauchy's weights, and errors of groups.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace backlash::diagnosis {

struct PriorRegression {
  static constexpr std::size_t kMost = 16;  // columns of a row
  struct Row {
    std::array<double, kMost> value;
    std::array<Eigen::Index, kMost> column;
    std::size_t count = 0;
    double y = 0;
    std::size_t group = 0;  // from 0 on: what is left of the rows of one is correlated

    /// Columns in increasing order.
    void add(Eigen::Index at, double x) { column[count] = at, value[count++] = x; }
  };

  std::vector<Row> rows;
  Eigen::VectorXd mean, deviation;  // of the unknowns, before the rows are seen; infinite: nothing is known
  double scale = 0;                 // of what is left, to begin with: 0: a fifth of y
  std::size_t groups = 0;

  // The solution.
  Eigen::VectorXd x;
  Eigen::MatrixXd inverse;  // of the normal equations
  std::vector<double> left, weight;

  /// One solution with the weights of the one before; the first one with equal weights.
  void step();
  /// As how many independent rows these count, by what is left of them and of their groups.
  double independent() const;
  /// What one unit of `inverse` is as a variance.
  double unit() const;
  /// Variance of the sum of x times `of`: of groups of rows (Liang and Zeger 1986), and of what was known
  /// before.
  double variance(const Eigen::VectorXd& of) const;
};

}  // namespace backlash::diagnosis
