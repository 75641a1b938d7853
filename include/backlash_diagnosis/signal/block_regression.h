// SPDX-License-Identifier: BSD-3-Clause
// How much of a signal's variance a regression on other signals predicts (cross-validated over blocks).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace backlash::signal {

struct BlockRegressionSettings {
  std::vector<double> ridges = {1e-4, 1e-3, 1e-2, 0.1, 1};  // choice: per sample, of columns of unit square
  int draws = 400;                                          // choice (time): of blocks, for the interval
  std::uint64_t seed = 1;                                   // choice
  int flips = 39;      // theory: the largest of 39 chance shares is exceeded by chance with probability 1/40
  double risk = 0.05;  // choice: of the interval, beyond both ends together
};

/// Predicted share of the sum of squares, at most 1, with its interval from a bootstrap over blocks. A lower
/// end below 0 means that the prediction may be no better than 0.
struct PredictedShare {
  double value = 0, lower = 0, upper = 0;
  /// The largest share found when the signs of the blocks of y are drawn at random, `flips` times. This
  /// leaves noise of any colour as it was, if it is not correlated between blocks, and destroys what follows
  /// the features: a `value` above it is no chance.
  double chance = 0;
};

/// The share of y that a ridge regression on the columns of `features` predicts: each block (numbers from 0,
/// one per row) from a fit to all other blocks, with the ridge that predicts best. Blocks should be longer
/// than the correlation of y; otherwise the neighbours of a sample predict its noise. All zeros for fewer
/// than four blocks. Ridge regression: Hoerl and Kennard (1970); cross-validation: Stone (1974).
PredictedShare predicted_share(const Eigen::MatrixXd& features, const Eigen::VectorXd& y,
                               const std::vector<int>& block, const BlockRegressionSettings& settings = {});

/// Hat functions (linear B-splines) of x, one per column, with `count` knots at quantiles of x, so that there
/// are equally many samples between any two knots. Knots that coincide are merged; no columns if x is
/// constant.
Eigen::MatrixXd hat_functions(const std::vector<double>& x, int count);

/// Products of each column of a with each of b, row by row: a basis for functions of both.
Eigen::MatrixXd row_products(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace backlash::signal
