// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/clearance_flanks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/fit/nonlinear.h"
#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {
namespace {

/// Least squares over what is not known of the contact, at given flanks; damping >= 0.
FlankContact contact_of(const std::vector<FlankPassage>& passages, const Flanks& flanks, double stiffness) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (const FlankPassage& p : passages) {
    const Eigen::MatrixXd c = p.columns(flanks);
    normal += signal::gram(c);
    right -= c.transpose() * p.measured();
  }
  if (std::isfinite(stiffness))
    return {stiffness, std::max(0.0, (right[1] - normal(0, 1) * stiffness) / normal(1, 1))};
  const Eigen::Vector2d k = signal::solve_square(normal, right);
  if (k[1] < 0) return {right[0] / normal(0, 0), 0};
  return {k[0], k[1]};
}

Eigen::VectorXd residuals_of(const std::vector<FlankPassage>& passages, const Flanks& flanks,
                             const FlankContact& contact) {
  Eigen::Index rows = 0;
  for (const FlankPassage& p : passages) rows += p.size();
  Eigen::VectorXd all(rows);
  Eigen::Index at = 0;
  for (const FlankPassage& p : passages) {
    all.segment(at, p.size()) =
        p.measured() + p.columns(flanks) * Eigen::Vector2d(contact.stiffness, contact.damping);
    at += p.size();
  }
  return all;
}

}  // namespace

FlankPassage::FlankPassage(const Eigen::VectorXd& position, Eigen::VectorXd smooth, double interval,
                           int push_degree)
    : interval_(interval), smooth_(std::move(smooth)) {
  const int polynomial = push_degree + 3;
  Eigen::MatrixXd powers(size(), polynomial);
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(size(), -1, 1);
  powers.col(0).setOnes();
  for (int k = 1; k < polynomial; ++k) powers.col(k) = powers.col(k - 1).array() * t;
  basis_ = signal::orthonormal_basis(powers);
  measured_ = without_polynomial(position);
}

Eigen::MatrixXd FlankPassage::columns(const Flanks& flanks) const {
  const double lower = flanks.lower, upper = flanks.lower + flanks.gap;
  Eigen::VectorXd penetration(size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    const double x = smooth_[i];
    penetration[i] = x > upper ? x - upper : x < lower ? x - lower : 0;
  }
  Eigen::MatrixXd c(size(), 2);
  const Eigen::VectorXd once = integral(penetration);  // also the double integral of the penetration's rate
  c.col(0) = without_polynomial(integral(once));
  c.col(1) = without_polynomial(once);
  return c;
}

Eigen::VectorXd FlankPassage::integral(const Eigen::VectorXd& y) const {
  Eigen::VectorXd sum(y.size());
  sum[0] = 0;
  for (Eigen::Index i = 1; i < y.size(); ++i) sum[i] = sum[i - 1] + interval_ / 2 * (y[i] + y[i - 1]);
  return sum;
}

Eigen::VectorXd FlankPassage::without_polynomial(const Eigen::VectorXd& y) const {
  return y - basis_ * (basis_.transpose() * y);
}

/// fitted.
PassageFit fit_flanks(const std::vector<FlankPassage>& passages, double low, double high,
                      const FlankContact& known) {
  const auto contact_at = [&](const Flanks& f) {
    return std::isfinite(known.damping) ? known : contact_of(passages, f, known.stiffness);
  };
  const auto residuals = [&](const Eigen::VectorXd& p) -> Eigen::VectorXd {
    const Flanks f{p[0], p[1]};
    if (!(f.gap > 0)) throw CannotIdentify("no gap");
    return residuals_of(passages, f, contact_at(f));
  };
  const double travel = high - low;
  Eigen::Vector2d start(low + 0.2 * travel, 0.6 * travel);
  double least = std::numeric_limits<double>::infinity();
  for (double below = 0.05; below < 0.5; below += 0.08)
    for (double above = 0.05; below + above < 0.95 && above < 0.5; above += 0.08) {
      const Eigen::Vector2d p(low + below * travel, (1 - below - above) * travel);
      if (!(contact_at({p[0], p[1]}).stiffness > 0)) continue;
      const double sum = residuals(p).squaredNorm();
      if (!(sum < least)) continue;
      least = sum;
      start = p;
    }
  const signal::LeastSquaresFit fit =
      fit::fit_nonlinear(residuals, start, Eigen::Vector2d::Constant(0.1 * travel));
  PassageFit f;
  f.flanks = {fit.values[0], fit.values[1]};
  f.contact = contact_at(f.flanks);
  const double unknowns = 2 + passages[0].polynomial() * double(passages.size()) + 2;
  const double more = std::sqrt(double(fit.residuals.size() - 2) / (double(fit.residuals.size()) - unknowns));
  f.gap = fit.parameter(1);
  f.gap.standard_error *= more;
  f.deviation = fit.deviation * more;
  f.residuals = fit.residuals;
  for (const FlankPassage& p : passages) f.without_flanks += p.measured().squaredNorm();
  f.without_flanks = std::sqrt(f.without_flanks / double(f.residuals.size()));
  return f;
}

}  // namespace backlash::identification
