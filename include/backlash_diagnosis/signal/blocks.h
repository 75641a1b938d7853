// SPDX-License-Identifier: BSD-3-Clause
// Standard errors of correlated samples: statistics over blocks that are longer than the correlation.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::signal {

/// Means of consecutive blocks of `length` samples; the rest at the end is left out.
std::vector<double> block_means(const std::vector<double>& values, std::size_t length);

/// Mean of a correlated signal, with the standard error from the scatter of the means of ten to nineteen
/// batches (NaN for fewer than ten values). The error is right if a batch is longer than the correlation.
Measured batch_mean(const std::vector<double>& values);

/// The range [first, second) of samples in which a signal is as steady as in its middle half. A value is off
/// if it differs from the median of the middle half by more than four standard deviations (from the median
/// absolute deviation) and by more than `allowed_change` of that median. In the first `most` (0 to 1/2) of
/// the signal the last value that is off and everything before it are left out; at the end likewise.
std::pair<std::size_t, std::size_t> steady_range(const std::vector<double>& values, double most,
                                                 double allowed_change);

/// How the least-squares solution x of A x = b changes if one block of rows is left out: one column per
/// block, minus their mean. `residuals`: b - A x at the solution. `block`: the block of each row, numbered
/// from 0. Throws CannotIdentify for fewer than four blocks, and if without one of the blocks the other rows
/// do not determine x.
Eigen::MatrixXd jackknife_changes(const Eigen::MatrixXd& a, const Eigen::VectorXd& residuals,
                                  const std::vector<std::size_t>& block);

/// Covariance of x from these changes (jackknife, Efron 1982). Rows inside a block may depend on each other.
/// Throws as jackknife_changes.
Eigen::MatrixXd jackknife_covariance(const Eigen::MatrixXd& a, const Eigen::VectorXd& residuals,
                                     const std::vector<std::size_t>& block);

/// Jackknife standard error of a single number from its changes, one per block left out.
double jackknife_error(const Eigen::VectorXd& changes);

}  // namespace backlash::signal
