// SPDX-License-Identifier: BSD-3-Clause
#include "play_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>

#include "backlash_diagnosis/signal/distributions.h"

namespace backlash::geared_arm {
namespace {

constexpr double kSameColumn = 1e-9;  // of its size: a column that is constant has no effect
constexpr double kPowers[] = {1, 0.9, 0.8, 0.73, 2.0 / 3, 0.6, 0.5};  // from a spring to beyond Hertz
// Relative increase of a spring's stiffness from no load to the largest.
constexpr double kHardening[] = {0.1, 0.2, 0.5, 1, 2, 5, 10};
// Ratio of squares up to which a law is not ruled out: none of them is the true one exactly, and what is left
// comes of other causes too. Choice, see the drawn arms in doc/evidence/arm.md.
constexpr double kSameLaw = 1.5;
constexpr double kLawErrors = 3;      // standard errors by which the record distinguishes two laws: choice
constexpr double kOutOfCentre = 0.8;  // of the squares, which an encoder's errors must leave: choice
constexpr int kMostWaves = 3;         // per turn, of an encoder: more are a gear's, and average out; choice
constexpr double kTurned = 0.5;       // rad, of travel, below which it is a straight line: choice

/// Deflection over load, of loads and in deflections of the size of 1.
struct Law {
  std::string name;
  std::function<double(double)> deflection;  // of a load >= 0
};

/// u + h u^2 = (1 + h) t.
double hardening_once(double t, double h) {
  return (std::sqrt(1 + 4 * h * (1 + h) * t) - 1) / (2 * h);
}

/// u + h u^3 = (1 + h) t.
double hardening_twice(double t, double h) {
  const double p = 1 / h, q = (1 + h) * t / h;
  return 2 * std::sqrt(p / 3) * std::sinh(std::asinh(1.5 * q / p * std::sqrt(3 / p)) / 3);
}

std::vector<Law> laws() {
  std::vector<Law> all;
  for (const double power : kPowers)
    all.push_back({power == 1 ? "a spring" : fmt::format("teeth that yield as the load to {:.2g}", power),
                   [power](double t) { return std::pow(t, power); }});
  for (const double h : kHardening) {
    const std::string name = fmt::format("a spring that gets {:.2g} times as hard", 1 + h);
    all.push_back({name, [h](double t) { return hardening_once(t, h / 2); }});
    all.push_back({name, [h](double t) { return hardening_twice(t, h / 3); }});
  }
  return all;
}

struct Fit {
  double play = 0, error = 0;
  double compliance = 0, softest = 0;     // rad/(N m), at the mean load and at the least one that counts
  double between = 0, between_error = 0;  // rad: play and the deflection at the mean load on both flanks
  double squares = 0;                     // of the residuals
  double degrees = 0;                     // of freedom: stays less what is fitted
};

/// What is the same for all laws.
class Flanks {
 public:
  explicit Flanks(const FlankRows& rows) : rows_(rows) {
    for (std::size_t k = 0; k < rows.side.size(); ++k) {
      if (rows.side[k] == 0) continue;
      used_.push_back(k);
      most_ = std::fmax(most_, std::fabs(rows.torque[k]));
      least_ = std::fmin(least_, std::fabs(rows.torque[k]));
    }
    y_.resize(n());
    for (Eigen::Index r = 0; r < n(); ++r) y_[r] = rows.twist[at(r)];
    stays_ = *std::max_element(rows.stay.begin(), rows.stay.end()) + 1;
  }

  Fit fit(const Law& law, int waves) const;
  Eigen::Index n() const { return Eigen::Index(used_.size()); }
  bool turns() const {
    double least = INFINITY, largest = -INFINITY;
    for (const std::size_t k : used_)
      least = std::fmin(least, rows_.position[k]), largest = std::fmax(largest, rows_.position[k]);
    return largest - least > kTurned;
  }
  /// Ratio of squares beyond which the record distinguishes two models.
  double apart() const { return 1 + kLawErrors * kLawErrors / std::fmax(1, double(n()) / rows_.per_cycle); }

 private:
  std::size_t at(Eigen::Index row) const { return used_[std::size_t(row)]; }
  Eigen::MatrixXd columns(const Law& law, int waves) const;

  const FlankRows& rows_;
  std::vector<std::size_t> used_;  // rows on a flank
  Eigen::VectorXd y_;
  double most_ = 0, least_ = INFINITY;  // N m
  std::size_t stays_ = 0;
};

Eigen::MatrixXd Flanks::columns(const Law& law, int waves) const {
  Eigen::MatrixXd x(n(), 5 + 2 * waves);
  for (Eigen::Index r = 0; r < n(); ++r) {
    const double t = rows_.torque[at(r)] / most_, q = rows_.position[at(r)];
    x.row(r).head<5>() << rows_.side[at(r)] / 2.0, std::copysign(law.deflection(std::fabs(t)), t), 1, q,
        rows_.speed[at(r)];
    for (int k = 1; k <= waves; ++k) x(r, 3 + 2 * k) = std::cos(k * q), x(r, 4 + 2 * k) = std::sin(k * q);
  }
  for (Eigen::Index c = 3; c < x.cols(); ++c) {  // less correlated so
    x.col(c).array() -= x.col(c).mean();
    if (x.col(c).norm() < kSameColumn * std::sqrt(double(n()))) x.col(c).setZero();
  }
  return x;
}

Fit Flanks::fit(const Law& law, int waves) const {
  const Eigen::MatrixXd x = columns(law, waves);
  const Eigen::VectorXd scale = x.colwise().norm().cwiseMax(1e-300).transpose();
  const Eigen::MatrixXd scaled = x * scale.cwiseInverse().asDiagonal();
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(scaled);
  const Eigen::VectorXd b = solver.solve(y_), residual = y_ - scaled * b;
  const Eigen::MatrixXd inverse = solver.pseudoInverse();
  double load = 0;
  for (const std::size_t k : used_) load += std::fabs(rows_.torque[k]) / (most_ * double(n()));
  Fit f;
  f.degrees = std::fmax(1, double(stays_) - double(solver.rank()));
  const auto error_of = [&](double first, double second) {  // of first b[0] + second b[1]
    std::vector<double> influence(stays_, 0.0);             // of each stay's residuals
    for (Eigen::Index r = 0; r < n(); ++r)
      influence[rows_.stay[at(r)]] += (first * inverse(0, r) + second * inverse(1, r)) * residual[r];
    double variance = 0;
    for (const double each : influence) variance += each * each;
    return std::sqrt(variance * double(stays_) / f.degrees);
  };
  f.play = b[0] / scale[0];
  f.error = error_of(1 / scale[0], 0);
  const double yield = 2 * law.deflection(load) / scale[1];
  f.between = f.play + yield * b[1];
  f.between_error = error_of(1 / scale[0], yield);
  const auto compliance = [&](double t) {
    return b[1] / scale[1] * (law.deflection(1.01 * t) - law.deflection(0.99 * t)) / (0.02 * t * most_);
  };
  f.compliance = compliance(load), f.softest = compliance(least_ / most_);
  f.squares = residual.squaredNorm();
  return f;
}

}  // namespace

FlankPlayFit fit_flank_play(const FlankRows& rows) {
  const Flanks flanks(rows);
  const std::vector<Law> all = laws();
  const auto fits_of = [&](int waves) {
    std::vector<Fit> fits;
    for (const Law& law : all) fits.push_back(flanks.fit(law, waves));
    return fits;
  };
  const auto least_of = [](const std::vector<Fit>& fits) {
    return std::size_t(std::min_element(fits.begin(), fits.end(),
                                        [](const Fit& a, const Fit& b) { return a.squares < b.squares; }) -
                       fits.begin());
  };
  std::vector<Fit> fits = fits_of(0);
  std::size_t best = least_of(fits);
  for (int waves = 1; flanks.turns() && waves <= kMostWaves; ++waves) {
    std::vector<Fit> other = fits_of(waves);
    const std::size_t least = least_of(other);
    if (other[least].squares * flanks.apart() < kOutOfCentre * fits[best].squares)
      fits = std::move(other), best = least;
  }
  FlankPlayFit out;
  out.play = fits[best].play, out.error = fits[best].error;
  out.compliance = fits[best].compliance, out.softest = fits[best].softest;
  out.between = fits[best].between;
  out.between_error = signal::student_t_quantile(0.975, fits[best].degrees) * fits[best].between_error;
  out.residual = std::sqrt(fits[best].squares / double(flanks.n()));
  out.law = all[best].name;
  out.lower = INFINITY, out.upper = -INFINITY;
  for (const Fit& f : fits) {
    if (f.squares > std::fmax(kSameLaw, flanks.apart()) * fits[best].squares) continue;
    const double scatter = signal::student_t_quantile(0.975, f.degrees) * f.error;
    out.lower = std::fmin(out.lower, f.play - scatter), out.upper = std::fmax(out.upper, f.play + scatter);
  }
  return out;
}

}  // namespace backlash::geared_arm
