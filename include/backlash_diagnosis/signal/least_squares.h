// SPDX-License-Identifier: BSD-3-Clause
// Least squares with what belongs to it: standard errors, residuals, and answers that a few outliers do not
// spoil.
#pragma once

#include <Eigen/Core>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::signal {

struct LeastSquaresFit {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;  // of the values
  Eigen::VectorXd residuals;   // measured minus fitted, one per row
  Eigen::MatrixXd jacobian;    // of the residuals, fit::fit_nonlinear only
  bool converged = false;      // fit::fit_nonlinear only; else it ran out of iterations
  double deviation = 0;        // standard deviation of the residuals, degrees of freedom considered

  Measured parameter(Eigen::Index i) const;
};

/// Minimises |b - A x|. Columns are scaled before they are decomposed. Throws CannotIdentify with fewer rows
/// than columns + 1 or columns that depend on each other (condition beyond 1e10).
LeastSquaresFit fit_linear(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// The same with Huber's weights (1.345 standard deviations, scale from the median absolute residual): up to
/// a third of the rows may be wrong. Standard errors after Huber (1981, Section 7.6).
LeastSquaresFit fit_robust(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Covariance of the values where neighbouring rows are not independent: the gradients of the sum of squares
/// are summed over blocks of `block` successive rows, which count as independent (Liang and Zeger 1986), each
/// as if the fit had been made without it (Bell and McCaffrey 2002, their jackknife form). The last `known`
/// rows are independent and of variance 1. Needs `jacobian`.
Eigen::MatrixXd block_covariance(const LeastSquaresFit& fit, Eigen::Index block, Eigen::Index known = 0);

}  // namespace backlash::signal
