// SPDX-License-Identifier: BSD-3-Clause
// Least squares of a model whose residuals are known at points only: Levenberg and Marquardt's method of
// Ceres Solver (Agarwal, Mierle and others 2022) with differences of ours. The same answer on any number of
// threads.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/least_squares.h"

namespace backlash::fit {

/// Residuals of a model at given parameters, each divided by its own standard deviation.
using ResidualFunction = std::function<Eigen::VectorXd(const Eigen::VectorXd& parameters)>;

/// Receives the points, at most kPointsAtOnce, at which the residuals are asked for next: what they have in
/// common may be computed at once.
using AheadFunction = std::function<void(const std::vector<Eigen::VectorXd>& points)>;
constexpr int kPointsAtOnce = 16;

struct NonlinearOptions {
  int iterations = 50;  // steps that are tried; choice (time)
  // Of the decrease of the squares over their sum, and of a step over the way so far. Theory: 1e-6 of 10^4
  // squares is that of a tenth of a standard error.
  double tolerance = 1e-6;
  double step = 1e-4;  // of the differences, in units of `scale`
  // Differences to both sides. Where the model stumbles - a touch or a standstill more or less - a tiny step
  // to one side takes that for sensitivity; a wide one to both averages over such places.
  bool central = false;
  bool parallel = false;  // differences on all processors: the function is called from several threads
  AheadFunction ahead;    // of the differences; may be empty
};

/// Minimises the squares of the residuals. `scale` holds one typical size > 0 per parameter. Values for which
/// the function throws Error or gives a number that is not finite are taken for too far. Covariance from the
/// Jacobian and the residuals' own variance. Throws CannotIdentify where the start itself is refused or a
/// parameter changes nothing.
signal::LeastSquaresFit fit_nonlinear(const ResidualFunction& residuals, const Eigen::VectorXd& start,
                                      const Eigen::VectorXd& scale, const NonlinearOptions& options = {});

}  // namespace backlash::fit
