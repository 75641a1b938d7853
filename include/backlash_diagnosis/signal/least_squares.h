// SPDX-License-Identifier: BSD-3-Clause
// Least squares with what belongs to it: standard errors, residuals, and answers that a few outliers do not
// spoil.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/measured.h"

namespace backlash::signal {

struct LeastSquaresFit {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;  // of the values
  Eigen::VectorXd residuals;   // measured minus fitted, one per row
  Eigen::MatrixXd jacobian;    // of the residuals, fit_nonlinear only
  bool converged = false;      // fit_nonlinear only; else it ran out of iterations
  double deviation = 0;        // standard deviation of the residuals, degrees of freedom considered

  Measured parameter(Eigen::Index i) const;
};

/// Minimises |b - A x|. Columns are scaled before they are decomposed. Throws CannotIdentify with fewer rows
/// than columns + 1 or columns that depend on each other (condition beyond 1e10).
LeastSquaresFit fit_linear(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// The same with Huber's weights (1.345 standard deviations, scale from the median absolute residual): up to
/// a third of the rows may be wrong. Standard errors after Huber (1981, Section 7.6).
LeastSquaresFit fit_robust(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Residuals of a model at given parameters, each divided by its own standard deviation.
using ResidualFunction = std::function<Eigen::VectorXd(const Eigen::VectorXd& parameters)>;

/// Receives the points, at most kPointsAtOnce, at which the residuals are asked for next: what they have in
/// common may be computed at once.
using AheadFunction = std::function<void(const std::vector<Eigen::VectorXd>& points)>;
constexpr int kPointsAtOnce = 16;

struct NonlinearOptions {
  int iterations = 30;
  double tolerance =
      1e-6;            // of the relative decrease of the sum of squares, and of the step in units of `scale`
  double step = 1e-4;  // of the forward differences, in units of `scale`
  // Where the forward differences lead no further: steps with central ones over `wide_step`, in the same
  // units, which average over places where the model stumbles. 0: none.
  int wide_iterations = 0;
  double wide_step = 1e-2;
  bool parallel = false;  // differences on all processors: the function is called from several threads
  AheadFunction ahead;    // of the differences; may be empty
};

/// Levenberg and Marquardt with forward differences. `scale` holds one typical size > 0 per parameter. Values
/// for which the function throws Error or gives a number that is not finite are taken for too far. Covariance
/// from the Jacobian and the residuals' own variance. Throws CannotIdentify where the start itself is refused
/// or a parameter changes nothing.
LeastSquaresFit fit_nonlinear(const ResidualFunction& residuals, const Eigen::VectorXd& start,
                              const Eigen::VectorXd& scale, const NonlinearOptions& options = {});

/// Jacobian and covariance anew, with central differences over `steps` > 0 (in units of the parameters).
/// Where the model stumbles - a touch or a standstill more or less - a difference over a tiny step takes that
/// for sensitivity.
void widen_jacobian(LeastSquaresFit& fit, const ResidualFunction& residuals, const Eigen::VectorXd& steps,
                    const AheadFunction& ahead = {}, bool parallel = false);

/// Covariance of the values where neighbouring rows are not independent: the gradients of the sum of squares
/// are summed over blocks of `block` successive rows, which count as independent (Liang and Zeger 1986), each
/// as if the fit had been made without it (Bell and McCaffrey 2002, their jackknife form). The last `known`
/// rows are independent and of variance 1. Needs `jacobian`.
Eigen::MatrixXd block_covariance(const LeastSquaresFit& fit, Eigen::Index block, Eigen::Index known = 0);

}  // namespace backlash::signal
