// SPDX-License-Identifier: BSD-3-Clause
// How much of a signal other signals can say, whatever the law between them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace backlash::signal {

struct BlockRegressionSettings {
  std::vector<double> ridges = {1e-4, 1e-3, 1e-2, 0.1, 1};  // choice: per sample, of columns of unit square
  int draws = 400;                                          // choice (time): of blocks, for the interval
  std::uint64_t seed = 1;                                   // choice
  int flips = 39;      // theory: one share in forty is larger by chance than all of as many
  double risk = 0.05;  // choice: of the interval, beyond both ends together
};

/// Share of the sum of squares, 0 to 1 (the lower end may be below 0: then nothing is predicted), with its
/// interval from blocks drawn with replacement.
struct PredictedShare {
  double value = 0, lower = 0, upper = 0;
  /// The largest share of signals that are y with the sign of each block drawn anew: noise of any colour,
  /// that does not reach from block to block, stays the same by that, and what follows the features does not.
  double chance = 0;
};

/// Of y, by a ridge regression over the columns of `features`: each block (numbers from 0, one per row) is
/// predicted by a fit to all others, at the ridge that predicts best. Blocks should be longer than the
/// correlation of y: else neighbours of a sample predict its noise. Nothing is predicted of fewer than four
/// blocks. Hoerl and Kennard (1970), Stone (1974).
PredictedShare predicted_share(const Eigen::MatrixXd& features, const Eigen::VectorXd& y,
                               const std::vector<int>& block, const BlockRegressionSettings& settings = {});

/// Hat functions (linear B-splines) over the quantiles of x: piecewise linear functions of x with `count`
/// knots, as many samples between any two. Fewer columns where knots fall together, none where x is constant.
Eigen::MatrixXd hat_functions(const std::vector<double>& x, int count);

/// Products of each column of a with each of b, row by row: a function of both.
Eigen::MatrixXd row_products(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace backlash::signal
