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

/// Mean of a correlated signal: standard error from the scatter of the means of ten to nineteen batches
/// (fewer values: NaN). Honest where a batch is longer than the correlation.
Measured batch_mean(const std::vector<double>& values);

/// From where to where (one past the last) a signal is as steady as in its middle half: the last value within
/// `most` (0 to 1/2) of the signal from its start, that lies more than four deviations (and `allowed_change`
/// of the median) off the median, and all before it are left out, and so at the end. Deviation from the
/// median absolute one.
std::pair<std::size_t, std::size_t> steady_range(const std::vector<double>& values, double most,
                                                 double allowed_change);

/// How the least squares solution of A x = b changes where one block of rows after the other is left out: one
/// column per block, about their mean. `residuals` b - A x at the solution; `block` the number of each row's
/// block, 0 ... Throws CannotIdentify with fewer than four blocks, and where without one of them the unknowns
/// cannot be distinguished.
Eigen::MatrixXd jackknife_changes(const Eigen::MatrixXd& a, const Eigen::VectorXd& residuals,
                                  const std::vector<std::size_t>& block);

/// Covariance from them (jackknife, Efron 1982): needs no independence of the rows inside a block.
Eigen::MatrixXd jackknife_covariance(const Eigen::MatrixXd& a, const Eigen::VectorXd& residuals,
                                     const std::vector<std::size_t>& block);

/// The same for numbers of which the changes are known.
double jackknife_error(const Eigen::VectorXd& changes);

}  // namespace backlash::signal
