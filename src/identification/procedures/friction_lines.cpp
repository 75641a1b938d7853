// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/friction_lines.h"

#include <fmt/core.h>

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"
#include "backlash_diagnosis/signal/least_squares.h"
#include "backlash_diagnosis/signal/linear_algebra.h"

namespace backlash::identification {
namespace {

constexpr double kSameSpeed = 0.01;  // choice: relative: speeds closer than this count as one
constexpr double kSurprise = 0.01;   // choice: chance of so much curvature on a straight line, that is worth
                                     // a warning, or of a row so far off among all

struct Rows {
  Eigen::VectorXd speed, torque, error;
};

Rows rows_of(const std::vector<ConstantSpeedRun>& runs, double sign) {
  std::vector<const ConstantSpeedRun*> chosen;
  for (const auto& run : runs)
    if (run.speed.value * sign > 0) chosen.push_back(&run);
  const auto n = static_cast<Eigen::Index>(chosen.size());
  Rows rows{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    rows.speed[i] = chosen[i]->speed.value;
    rows.torque[i] = chosen[i]->torque.value;
    rows.error[i] = chosen[i]->torque.standard_error;
  }
  return rows;
}

std::size_t distinct_speeds(const Eigen::VectorXd& speed) {
  std::vector<double> sizes;
  for (const double w : speed) sizes.push_back(std::fabs(w));
  std::sort(sizes.begin(), sizes.end());
  std::size_t count = 0;
  double last = 0;
  for (const double w : sizes)
    if (count == 0 || w > last * (1 + kSameSpeed)) ++count, last = w;
  return count;
}

/// Weighted least squares of a straight line; covariance for weights that are 1 / variance.
struct Line {
  Eigen::Vector2d values;
  Eigen::Matrix2d covariance;
  double chi2;
};

Line weighted_line(const Rows& rows, const Eigen::VectorXd& weight) {
  Eigen::MatrixXd a(rows.speed.size(), 2);
  a << Eigen::VectorXd::Ones(a.rows()), rows.speed;
  Line line;
  line.covariance = signal::symmetric_inverse(signal::gram(weight.cwiseSqrt().asDiagonal() * a));
  line.values = line.covariance * (a.transpose() * weight.cwiseProduct(rows.torque));
  line.chi2 = weight.dot((rows.torque - a * line.values).cwiseAbs2());
  return line;
}

/// Weights 1 / (s^2 + u^2); u^2 from chi^2 = degrees of freedom.
Eigen::VectorXd weights(const Rows& rows) {
  const auto with = [&](double u2) {
    return Eigen::VectorXd((rows.error.cwiseAbs2().array() + u2).inverse().matrix());
  };
  const double freedom = double(rows.speed.size()) - 2;
  const double most = 1e-12 + rows.torque.squaredNorm();
  if (freedom <= 0 || (rows.error.minCoeff() > 0 && weighted_line(rows, with(0)).chi2 <= freedom))
    return with(0);
  const auto excess = [&](double u2) { return weighted_line(rows, with(u2)).chi2 - freedom; };
  if (excess(most) >= 0) return with(most);
  std::uintmax_t calls = 200;
  const double smallest = std::numeric_limits<double>::min();  // u^2 = 0 may divide by an error of 0
  if (excess(smallest) <= 0) return with(smallest);
  const auto root = boost::math::tools::toms748_solve(excess, smallest, most,
                                                      boost::math::tools::eps_tolerance<double>(), calls);
  return with(root.second);
}

/// t value of one more column beside constant and speed, and its coefficient.
std::pair<double, double> extra_term(const Rows& rows, const Eigen::VectorXd& weight,
                                     const Eigen::VectorXd& column) {
  const Eigen::VectorXd root = weight.cwiseSqrt();
  Eigen::MatrixXd a(rows.speed.size(), 3);
  a << Eigen::VectorXd::Ones(a.rows()), rows.speed, column;
  const signal::Measured term =
      signal::fit_linear(root.asDiagonal() * a, root.cwiseProduct(rows.torque)).parameter(2);
  return {term.value, term.value / term.standard_error};
}

void test_curvature(FrictionLine& line, const Rows& rows, const Eigen::VectorXd& weight, double sign) {
  const Eigen::VectorXd root = sign * rows.speed.cwiseAbs().cwiseSqrt();
  Eigen::MatrixXd a(rows.speed.size(), 2);
  a << Eigen::VectorXd::Ones(a.rows()), root;
  const Eigen::VectorXd scale = weight.cwiseSqrt();
  const signal::LeastSquaresFit fit =
      signal::fit_linear(scale.asDiagonal() * a, scale.cwiseProduct(rows.torque));
  line.root_a = fit.values[0];
  line.root_b = fit.values[1];
  line.root_rms = std::sqrt((rows.torque - a * fit.values).squaredNorm() / double(a.rows()));
  std::tie(line.quadratic, line.quadratic_t) = extra_term(rows, weight, rows.speed.cwiseAbs2());
  line.root_t = extra_term(rows, weight, root).second;
  const int freedom = int(a.rows()) - 3;
  if (std::min(signal::student_t_two_sided(line.quadratic_t, freedom),
               signal::student_t_two_sided(line.root_t, freedom)) > kSurprise)
    return;
  const bool concave = line.quadratic * sign < 0;
  line.warnings.push_back(
      fmt::format("a straight line leaves a {} trend: quadratic term {:.3g} N m s^2/rad^2 (t = {:.3g}), root "
                  "(t = {:.3g}); a + b sqrt(|w|) leaves {:.3g} N m rms, the line {:.3g} N m",
                  std::string(concave ? "concave" : "convex"), line.quadratic, line.quadratic_t, line.root_t,
                  line.root_rms, line.rms));
}

/// Residual of each row against the line through the others, over its standard error.
void name_far_rows(FrictionLine& line, const Rows& rows, const Eigen::VectorXd& weight) {
  const Eigen::Index n = rows.speed.size();
  if (n < 5) return;
  const Line all = weighted_line(rows, weight);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector2d x(1, rows.speed[i]);
    const double leverage = weight[i] * x.dot(all.covariance * x);
    const double scaled = weight[i] * line.residual[i] * line.residual[i] / (1 - leverage);
    const double variance = (all.chi2 - scaled) / double(n - 3);
    const double t = std::sqrt(scaled / std::max(variance, 1e-12 * all.chi2));
    if (double(n) * signal::student_t_two_sided(t, int(n) - 3) < kSurprise)
      line.warnings.push_back(
          fmt::format("the run at {:.3g} rad/s ({:.3g} N m) lies {:.3g} standard deviations off the line "
                      "through the others",
                      rows.speed[i], rows.torque[i], t));
  }
}

}  // namespace

FrictionLine fit_friction_line(const std::vector<ConstantSpeedRun>& runs, Direction direction) {
  const double sign = direction == Direction::positive ? 1 : -1;
  const std::string name = sign > 0 ? "positive" : "negative";
  const Rows rows = rows_of(runs, sign);
  const std::size_t speeds = distinct_speeds(rows.speed);
  if (speeds < 2)
    throw CannotIdentify("friction in " + name + " direction: runs at " + std::to_string(speeds) +
                         " distinct speeds, a line needs two");
  const Eigen::Index n = rows.speed.size();
  const bool known = rows.error.allFinite();
  if (n < 3 && !known)
    throw CannotIdentify("friction in " + name + " direction: two runs without standard errors");
  const Eigen::VectorXd weight = known ? weights(rows) : Eigen::VectorXd::Ones(n);
  Line line = weighted_line(rows, weight);
  if (!known) line.covariance *= line.chi2 / double(n - 2);
  FrictionLine out;
  out.coulomb = {line.values[0], std::sqrt(line.covariance(0, 0))};
  out.viscous = {line.values[1], std::sqrt(line.covariance(1, 1))};
  out.covariance = line.covariance(0, 1);
  double squares = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    out.speed.push_back(rows.speed[i]);
    out.torque.push_back(rows.torque[i]);
    out.residual.push_back(rows.torque[i] - line.values[0] - line.values[1] * rows.speed[i]);
    squares += out.residual.back() * out.residual.back();
  }
  out.rms = std::sqrt(squares / double(n));
  if (speeds >= 4) test_curvature(out, rows, weight, sign);
  name_far_rows(out, rows, weight);
  return out;
}

}  // namespace backlash::identification
