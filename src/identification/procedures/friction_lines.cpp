// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/identification/procedures/friction_lines.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/signal/blocks.h"
#include "backlash_diagnosis/signal/least_squares.h"

namespace backlash {
namespace {

constexpr double kSameSpeed = 0.01;  // choice: relative: speeds closer than this count as one
constexpr double kSurprise = 0.01;   // choice: chance of so much curvature on a straight line, that is worth
                                    // telling, or of a row so far off among all

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
  line.covariance = Eigen::Matrix2d(a.transpose() * weight.asDiagonal() * a).inverse();
  line.values = line.covariance * (a.transpose() * weight.cwiseProduct(rows.torque));
  line.chi2 = weight.dot((rows.torque - a * line.values).cwiseAbs2());
  return line;
}

/// Weights 1 / (s^2 + u^2); u^2 from chi^2 = degrees of freedom by bisection.
Eigen::VectorXd weights(const Rows& rows) {
  const auto with = [&](double u2) {
    return Eigen::VectorXd((rows.error.cwiseAbs2().array() + u2).inverse().matrix());
  };
  const double freedom = double(rows.speed.size()) - 2;
  double low = 0, high = 1e-12 + rows.torque.squaredNorm();
  if (freedom <= 0 || (rows.error.minCoeff() > 0 && weighted_line(rows, with(0)).chi2 <= freedom))
    return with(0);
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (weighted_line(rows, with(middle)).chi2 > freedom ? low : high) = middle;
  }
  return with(high);
}

/// P(|T| > t) of Student's t with whole degrees of freedom (Abramowitz and Stegun 1964, 26.7.3 and 26.7.4).
double chance_of(double t, int freedom) {
  const double angle = std::atan(std::fabs(t) / std::sqrt(double(freedom)));
  const double c = std::cos(angle);
  const bool odd = freedom % 2 == 1;
  double term = odd ? c : 1, sum = freedom > 1 ? term : 0;
  for (int k = odd ? 3 : 2; k <= freedom - 2; k += 2) sum += term *= c * c * double(k - 1) / double(k);
  return 1 - (odd ? 2 / M_PI * (angle + std::sin(angle) * sum) : std::sin(angle) * sum);
}

/// t value of one more column beside constant and speed, and its coefficient.
std::pair<double, double> extra_term(const Rows& rows, const Eigen::VectorXd& weight,
                                     const Eigen::VectorXd& column) {
  const Eigen::VectorXd root = weight.cwiseSqrt();
  Eigen::MatrixXd a(rows.speed.size(), 3);
  a << Eigen::VectorXd::Ones(a.rows()), rows.speed, column;
  const Measured term = fit_linear(root.asDiagonal() * a, root.cwiseProduct(rows.torque)).parameter(2);
  return {term.value, term.value / term.standard_error};
}

void test_curvature(FrictionLine& line, const Rows& rows, const Eigen::VectorXd& weight, double sign) {
  const Eigen::VectorXd root = sign * rows.speed.cwiseAbs().cwiseSqrt();
  Eigen::MatrixXd a(rows.speed.size(), 2);
  a << Eigen::VectorXd::Ones(a.rows()), root;
  const Eigen::VectorXd scale = weight.cwiseSqrt();
  const LeastSquaresFit fit = fit_linear(scale.asDiagonal() * a, scale.cwiseProduct(rows.torque));
  line.root_a = fit.values[0];
  line.root_b = fit.values[1];
  line.root_rms = std::sqrt((rows.torque - a * fit.values).squaredNorm() / double(a.rows()));
  std::tie(line.quadratic, line.quadratic_t) = extra_term(rows, weight, rows.speed.cwiseAbs2());
  line.root_t = extra_term(rows, weight, root).second;
  const int freedom = int(a.rows()) - 3;
  if (std::min(chance_of(line.quadratic_t, freedom), chance_of(line.root_t, freedom)) > kSurprise) return;
  const bool concave = line.quadratic * sign < 0;
  line.warnings.push_back("a straight line leaves a " + std::string(concave ? "concave" : "convex") +
                          " trend: quadratic term " + figure(line.quadratic) +
                          " N m s^2/rad^2 (t = " + figure(line.quadratic_t) +
                          "), root (t = " + figure(line.root_t) + "); a + b sqrt(|w|) leaves " +
                          figure(line.root_rms) + " N m rms, the line " + figure(line.rms) + " N m");
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
    if (double(n) * chance_of(t, int(n) - 3) < kSurprise)
      line.warnings.push_back("the run at " + figure(rows.speed[i]) + " rad/s (" + figure(rows.torque[i]) +
                              " N m) lies " + figure(t) +
                              " standard deviations off the line through the others");
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

LoadFriction load_friction(const FrictionLine& drive, const FrictionLine& motor) {
  const auto difference = [](const Measured& a, const Measured& b) {
    return Measured{a.value - b.value, std::hypot(a.standard_error, b.standard_error)};
  };
  return {difference(drive.coulomb, motor.coulomb), difference(drive.viscous, motor.viscous)};
}

}  // namespace backlash
