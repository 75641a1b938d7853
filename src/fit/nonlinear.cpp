// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/fit/nonlinear.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "backlash_diagnosis/base/interruption.h"
#include "backlash_diagnosis/base/parallel.h"
#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::fit {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Residuals, or an empty vector where the parameters are refused.
VectorXd try_residuals(const ResidualFunction& f, const VectorXd& p) {
  stop_if_interrupted();
  try {
    VectorXd r = f(p);
    return r.allFinite() ? r : VectorXd();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error&) {
    return {};
  }
}

/// p with one of its values moved.
VectorXd beside(VectorXd p, Eigen::Index i, double step) {
  p[i] += step;
  return p;
}

/// In units of `scale` from the start. Leaves in `fit` the best point so far: Ceres asks for slopes there
/// alone.
class Cost : public ceres::CostFunction {
 public:
  Cost(const ResidualFunction& residuals, const VectorXd& scale, const NonlinearOptions& options,
       signal::LeastSquaresFit* fit)
      : f_(residuals),
        start_(fit->values),
        scale_(scale),
        steps_(options.step * scale),
        options_(options),
        fit_(*fit),
        p_(fit->values),
        r_(fit->residuals) {
    set_num_residuals(int(r_.size()));
    *mutable_parameter_block_sizes() = {int(start_.size())};
  }
  bool Evaluate(const double* const* z, double* residuals, double** slopes) const override {
    const VectorXd p = start_ + scale_.cwiseProduct(Eigen::Map<const VectorXd>(z[0], start_.size()));
    if (p != p_) r_ = try_residuals(f_, p_ = p);
    if (r_.size() != num_residuals()) return false;
    Eigen::Map<VectorXd>(residuals, r_.size()) = r_;
    if (slopes == nullptr || slopes[0] == nullptr) return true;
    fit_.values = p_, fit_.residuals = r_, fit_.jacobian = jacobian();
    Eigen::Map<RowMatrix>(slopes[0], r_.size(), p_.size()) = fit_.jacobian * scale_.asDiagonal();
    return true;
  }

 private:
  /// As many columns at a time as are announced to `ahead`.
  MatrixXd jacobian() const {
    MatrixXd j(r_.size(), p_.size());
    const int n = int(p_.size()), at_once = kPointsAtOnce / (options_.central ? 2 : 1);
    for (int first = 0; first < n; first += at_once) {
      const int end = std::min(first + at_once, n);
      std::vector<VectorXd> points;
      for (int i = first; i < end; ++i)
        for (const double sign : {1.0, -1.0})
          if (sign > 0 || options_.central) points.push_back(beside(p_, i, sign * steps_[i]));
      if (options_.ahead) options_.ahead(points);
      for_each_in_parallel(
          end - first, [&](int i) { j.col(first + i) = column(first + i); }, options_.parallel ? 0 : 1);
    }
    return j;
  }
  /// A step that is refused is taken the other way.
  VectorXd column(Eigen::Index i) const {
    VectorXd high = try_residuals(f_, beside(p_, i, steps_[i])), low;
    double width = 2 * steps_[i];
    if (options_.central || high.size() == 0) low = try_residuals(f_, beside(p_, i, -steps_[i]));
    if (high.size() == 0 && low.size() == 0)
      throw CannotIdentify("the model cannot be evaluated beside parameter " + std::to_string(i));
    for (VectorXd* side : {&high, &low})
      if (side->size() == 0) *side = r_, width = steps_[i];
    if (high == low) throw CannotIdentify("parameter " + std::to_string(i) + " has no effect on the record");
    return (high - low) / width;
  }

  const ResidualFunction& f_;
  const VectorXd start_, scale_, steps_;
  const NonlinearOptions& options_;
  signal::LeastSquaresFit& fit_;
  mutable VectorXd p_, r_;  // of the last point
};

}  // namespace

signal::LeastSquaresFit fit_nonlinear(const ResidualFunction& residuals, const VectorXd& start,
                                      const VectorXd& scale, const NonlinearOptions& options) {
  signal::LeastSquaresFit fit;
  fit.values = start, fit.residuals = residuals(start);
  if (fit.residuals.size() == 0 || !fit.residuals.allFinite())
    throw CannotIdentify("the model cannot be evaluated at the start values");
  VectorXd z = VectorXd::Zero(start.size());
  ceres::Problem problem;
  problem.AddResidualBlock(new Cost(residuals, scale, options, &fit), nullptr, z.data());
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = options.iterations;
  solver.function_tolerance = solver.parameter_tolerance = options.tolerance;
  solver.gradient_tolerance = 0;  // has the unit of the residuals
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  fit.converged = summary.termination_type == ceres::CONVERGENCE;
  const MatrixXd& j = fit.jacobian;
  if (j.rows() != fit.residuals.size() || !j.allFinite())
    throw CannotIdentify("the model cannot be evaluated beside the start values");
  const double variance = fit.residuals.squaredNorm() / std::max<double>(1, double(j.rows() - j.cols()));
  const VectorXd unit = j.colwise().norm().cwiseInverse();
  const MatrixXd scaled = j * unit.asDiagonal();
  fit.covariance =
      variance * (unit.asDiagonal() * signal::symmetric_inverse(signal::gram(scaled)) * unit.asDiagonal());
  fit.deviation = std::sqrt(variance);
  return fit;
}

}  // namespace backlash::fit
