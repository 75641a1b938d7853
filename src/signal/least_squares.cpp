// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/least_squares.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/linear_algebra.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::signal {
namespace {

constexpr double kWorstCondition = 1e10;
constexpr double kHuber = 1.345;  // standard deviations; 95 % efficient on normal residuals
constexpr int kRobustIterations = 50;

void require_rows(const Eigen::MatrixXd& a) {
  if (a.rows() <= a.cols())
    throw CannotIdentify(std::to_string(a.cols()) + " unknowns from only " + std::to_string(a.rows()) +
                         " equations");
}

/// Solves with rows multiplied by `root`; covariance for residuals of variance 1.
LeastSquaresFit solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& root) {
  const Eigen::MatrixXd weighted = root.asDiagonal() * a;
  const Eigen::VectorXd size = weighted.colwise().norm();
  if (!(size.minCoeff() > 0) || !size.allFinite())
    throw CannotIdentify("an unknown has no effect on the equations");
  const Eigen::VectorXd unit = size.cwiseInverse();
  const Eigen::MatrixXd scaled = weighted * unit.asDiagonal();
  const QrSolution solution = solve_least_squares(scaled, root.cwiseProduct(b));
  if (!(solution.diagonal_ratio > 1 / kWorstCondition))
    throw CannotIdentify("the equations do not determine the unknowns separately");
  LeastSquaresFit fit;
  fit.values = unit.cwiseProduct(solution.x);
  fit.residuals = b - a * fit.values;
  fit.covariance = unit.asDiagonal() * symmetric_inverse(gram(scaled)) * unit.asDiagonal();
  return fit;
}

}  // namespace

Measured LeastSquaresFit::parameter(Eigen::Index i) const {
  return {values[i], std::sqrt(covariance(i, i))};
}

LeastSquaresFit fit_linear(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  require_rows(a);
  LeastSquaresFit fit = solve(a, b, Eigen::VectorXd::Ones(a.rows()));
  const double variance = fit.residuals.squaredNorm() / double(a.rows() - a.cols());
  fit.covariance *= variance;
  fit.deviation = std::sqrt(variance);
  return fit;
}

LeastSquaresFit fit_robust(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  require_rows(a);
  const double smallest = 1e-12 * b.norm();
  Eigen::VectorXd root = Eigen::VectorXd::Ones(a.rows());
  LeastSquaresFit fit = solve(a, b, root);
  double scale = 0;
  for (int i = 0; i < kRobustIterations; ++i) {
    const Eigen::VectorXd before = fit.values;
    scale = std::max(
        smallest, kNormalPerMedianDeviation * median_magnitude({fit.residuals.begin(), fit.residuals.end()}));
    if (scale == 0) break;
    for (Eigen::Index k = 0; k < root.size(); ++k)
      root[k] = std::sqrt(std::min(1.0, kHuber * scale / std::max(smallest, std::fabs(fit.residuals[k]))));
    fit = solve(a, b, root);
    if ((fit.values - before).norm() <= 1e-10 * fit.values.norm()) break;
  }
  // Variance of the M-estimate: mean square of the clipped residuals over the square of their share inside.
  double sum = 0, inside = 0;
  for (const double r : fit.residuals) {
    sum += std::pow(std::min(std::fabs(r), kHuber * scale), 2);
    inside += std::fabs(r) <= kHuber * scale;
  }
  const double rows = double(a.rows()), share = std::max(inside / rows, 0.1);
  const double variance = sum / (rows - double(a.cols())) / (share * share);
  const Eigen::MatrixXd all = solve(a, b, Eigen::VectorXd::Ones(a.rows())).covariance;
  fit.covariance = all * variance;
  fit.deviation = scale;
  return fit;
}

Eigen::MatrixXd block_covariance(const LeastSquaresFit& fit, Eigen::Index block, Eigen::Index known) {
  const Eigen::MatrixXd& j = fit.jacobian;
  const Eigen::Index n = j.cols(), end = j.rows() - known;
  const Eigen::VectorXd unit = j.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd scaled = j * unit.asDiagonal();
  const Eigen::MatrixXd inverse = symmetric_inverse(gram(scaled)), one = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd outer = Eigen::MatrixXd::Zero(n, n);
  double blocks = 0;
  for (Eigen::Index row = 0; row < end; row += block, ++blocks) {
    const Eigen::Index rows = std::min(block, end - row);
    const auto part = scaled.middleRows(row, rows);
    const Eigen::VectorXd gradient = part.transpose() * fit.residuals.segment(row, rows);
    // As it would be had the block not drawn the fit to itself.
    const Eigen::VectorXd free = solve_square(one - product(gram(part), inverse), gradient);
    outer += free * free.transpose();
  }
  if (blocks <= double(n))
    throw CannotIdentify(std::to_string(long(blocks)) +
                         " stretches of the record are too few for the standard errors of " +
                         std::to_string(n) + " parameters");
  outer += gram(scaled.bottomRows(known));
  return unit.asDiagonal() * product(product(inverse, outer), inverse) * unit.asDiagonal();
}

}  // namespace backlash::signal
