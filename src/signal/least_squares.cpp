// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/signal/least_squares.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/interruption.h"
#include "backlash_diagnosis/base/parallel.h"
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

namespace {

constexpr double kLeastDamping = 1e-12, kMostDamping = 1e12;

bool usable(const Eigen::VectorXd& r) {
  return r.size() > 0 && r.allFinite();
}

/// Residuals, or an empty vector where the parameters are refused.
Eigen::VectorXd try_residuals(const ResidualFunction& f, const Eigen::VectorXd& p) {
  stop_if_interrupted();
  try {
    Eigen::VectorXd r = f(p);
    return usable(r) ? r : Eigen::VectorXd();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error&) {
    return {};
  }
}

/// p with one of its values moved.
Eigen::VectorXd beside(Eigen::VectorXd p, Eigen::Index i, double step) {
  p[i] += step;
  return p;
}

/// Steps of each column that it begins with.
using Steps = std::vector<Eigen::VectorXd>;

/// As many columns at a time as are announced to `ahead`.
void for_each_column(const Eigen::VectorXd& p, const Steps& steps, bool parallel, const AheadFunction& ahead,
                     const std::function<void(int)>& column) {
  const int n = int(p.size()), at_once = kPointsAtOnce / int(steps.size());
  for (int first = 0; first < n; first += at_once) {
    const int end = std::min(first + at_once, n);
    if (ahead) {
      std::vector<Eigen::VectorXd> points;
      for (int i = first; i < end; ++i)
        for (const Eigen::VectorXd& each : steps) points.push_back(beside(p, i, each[i]));
      ahead(points);
    }
    for_each_in_parallel(
        end - first, [&](int i) { column(first + i); }, parallel ? 0 : 1);
  }
}

void require_effect(const Eigen::MatrixXd& j, Eigen::Index i) {
  if (!(j.col(i).norm() > 0))
    throw CannotIdentify("parameter " + std::to_string(i) + " has no effect on the record");
}

/// Columns in units of `scale`; a step that is refused is tried the other way.
Eigen::MatrixXd jacobian(const ResidualFunction& f, const Eigen::VectorXd& p, const Eigen::VectorXd& r,
                         const Eigen::VectorXd& scale, const NonlinearOptions& options) {
  Eigen::MatrixXd j(r.size(), p.size());
  for_each_column(p, {options.step * scale}, options.parallel, options.ahead, [&](int i) {
    Eigen::VectorXd moved;
    double h = options.step;
    for (const double sign : {1.0, -1.0}) {
      h = sign * options.step;
      moved = try_residuals(f, beside(p, i, h * scale[i]));
      if (moved.size() == r.size()) break;
    }
    if (moved.size() != r.size())
      throw CannotIdentify("the model cannot be evaluated beside parameter " + std::to_string(i));
    j.col(i) = (moved - r) / h;
    require_effect(j, i);
  });
  return j;
}

Eigen::MatrixXd central_jacobian(const ResidualFunction& residuals, const Eigen::VectorXd& p,
                                 const Eigen::VectorXd& steps, const AheadFunction& ahead, bool parallel) {
  std::vector<Eigen::VectorXd> columns(std::size_t(p.size()));
  for_each_column(p, {steps, -steps}, parallel, ahead, [&](int i) {
    const Eigen::VectorXd above = try_residuals(residuals, beside(p, i, steps[i])),
                          below = try_residuals(residuals, beside(p, i, -steps[i]));
    if (above.size() == 0 || above.size() != below.size())
      throw CannotIdentify("the model cannot be evaluated beside parameter " + std::to_string(i));
    columns[std::size_t(i)] = (above - below) / (2 * steps[i]);
  });
  Eigen::MatrixXd j(columns.front().size(), p.size());
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    j.col(i) = columns[std::size_t(i)];
    require_effect(j, i);
  }
  return j;
}

struct Point {
  Eigen::VectorXd p, r;
};

/// The next step that lowers the sum of squares; whether another is worth it. `j` in units of `scale`.
bool advance(Point& at, const Eigen::MatrixXd& j, double& damping, const ResidualFunction& residuals,
             const Eigen::VectorXd& scale, const NonlinearOptions& options) {
  const Eigen::MatrixXd normal = gram(j);
  const Eigen::VectorXd gradient = j.transpose() * at.r;
  for (;; damping *= 10) {
    if (damping > kMostDamping) return false;
    Eigen::MatrixXd damped = normal;
    damped.diagonal() *= 1 + damping;
    const Eigen::VectorXd step = -solve_symmetric(damped, gradient);
    Point next{at.p + scale.cwiseProduct(step), {}};
    next.r = try_residuals(residuals, next.p);
    const bool small = step.norm() < options.tolerance;
    if (next.r.size() == at.r.size() && next.r.squaredNorm() < at.r.squaredNorm()) {
      const double gain = 1 - next.r.squaredNorm() / at.r.squaredNorm();
      at = std::move(next);
      damping = std::max(kLeastDamping, damping / 10);
      return gain >= options.tolerance && !small;
    }
    if (small) return false;
  }
}

double variance(const Eigen::MatrixXd& j, const Eigen::VectorXd& r) {
  return r.squaredNorm() / std::max<double>(1, double(j.rows() - j.cols()));
}

/// Of independent rows, with the residuals' own variance.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& j, const Eigen::VectorXd& r) {
  const Eigen::VectorXd unit = j.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd scaled = j * unit.asDiagonal();
  return variance(j, r) * (unit.asDiagonal() * symmetric_inverse(gram(scaled)) * unit.asDiagonal());
}

}  // namespace

LeastSquaresFit fit_nonlinear(const ResidualFunction& residuals, const Eigen::VectorXd& start,
                              const Eigen::VectorXd& scale, const NonlinearOptions& options) {
  Point at{start, residuals(start)};
  if (!usable(at.r)) throw CannotIdentify("the model cannot be evaluated at the start values");
  double damping = 1e-3;
  Eigen::MatrixXd j = jacobian(residuals, at.p, at.r, scale, options);
  LeastSquaresFit fit;
  for (int i = 0; i < options.iterations && !fit.converged; ++i) {
    fit.converged = !advance(at, j, damping, residuals, scale, options);
    if (!fit.converged) j = jacobian(residuals, at.p, at.r, scale, options);
  }
  damping = 1e-3;
  for (int i = 0; i < options.wide_iterations; ++i) {
    const Eigen::MatrixXd wide =
        central_jacobian(residuals, at.p, options.wide_step * scale, options.ahead, options.parallel) *
        scale.asDiagonal();
    if (!advance(at, wide, damping, residuals, scale, options)) break;
  }
  fit.values = at.p;
  fit.residuals = at.r;
  fit.jacobian = j * scale.cwiseInverse().asDiagonal();
  fit.covariance = covariance(fit.jacobian, at.r);
  fit.deviation = std::sqrt(variance(fit.jacobian, at.r));
  return fit;
}

void widen_jacobian(LeastSquaresFit& fit, const ResidualFunction& residuals, const Eigen::VectorXd& steps,
                    const AheadFunction& ahead, bool parallel) {
  fit.jacobian = central_jacobian(residuals, fit.values, steps, ahead, parallel);
  fit.covariance = covariance(fit.jacobian, fit.residuals);
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
