// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/least_squares.h"

namespace backlash::signal {
namespace {

/// A line y = 2 - 3 x at x = 0 .. n - 1, with normal noise.
struct Line {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
};

Line line(int n, double noise, unsigned seed) {
  Random generator(seed);
  Line l{Eigen::MatrixXd(n, 2), Eigen::VectorXd(n)};
  for (int i = 0; i < n; ++i) {
    l.a.row(i) << 1, i;
    l.b[i] = 2 - 3 * i + noise * generator.normal();
  }
  return l;
}

TEST(LeastSquares, LineThroughFourPointsByHand) {
  // x = 0..3, y = 1, 2, 2, 4: slope 0.9, intercept 0.9, squares 0.7, variance 0.35; s.e. sqrt(0.35/5),
  // sqrt(0.35 * 14/20).
  Eigen::MatrixXd a(4, 2);
  a << 1, 0, 1, 1, 1, 2, 1, 3;
  const LeastSquaresFit fit = fit_linear(a, Eigen::Vector4d(1, 2, 2, 4));
  EXPECT_NEAR(fit.parameter(0).value, 0.9, 1e-12);
  EXPECT_NEAR(fit.parameter(1).value, 0.9, 1e-12);
  EXPECT_NEAR(fit.parameter(0).standard_error, std::sqrt(0.35 * 0.7), 1e-12);
  EXPECT_NEAR(fit.parameter(1).standard_error, std::sqrt(0.07), 1e-12);
  EXPECT_NEAR(fit.residuals.squaredNorm(), 0.7, 1e-12);
}

TEST(LeastSquares, RobustFitIgnoresAFifthOfWildRows) {
  Line l = line(50, 0.1, 1);
  for (int i = 0; i < 50; i += 5) l.b[i] += 1000;
  const LeastSquaresFit robust = fit_robust(l.a, l.b);
  // Slope 0.1 / sqrt(50^3 / 12) = 0.001 without outliers; Huber's weights bias it by some of those.
  EXPECT_NEAR(robust.values[1], -3, 0.01);
  EXPECT_GT(std::fabs(fit_linear(l.a, l.b).values[0] - 2), 50);
}

TEST(LeastSquares, StandardErrorsMatchTheScatter) {
  double sum = 0, stated = 0;
  constexpr int kSeeds = 400;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const Line l = line(30, 0.5, seed);
    const Measured slope = fit_robust(l.a, l.b).parameter(1);
    sum += std::pow(slope.value + 3, 2);
    stated += std::pow(slope.standard_error, 2);
  }
  // A variance from 400 values is known to sqrt(2/400) = 7 %; three of them, and 10 % for Huber's small
  // sample.
  EXPECT_NEAR(sum / stated, 1, 0.31);
}

TEST(LeastSquares, RefusesWhatIsNotDetermined) {
  Eigen::MatrixXd twice(5, 2);
  twice << 1, 2, 2, 4, 3, 6, 4, 8, 5, 10;
  EXPECT_THROW(fit_linear(twice, Eigen::VectorXd::Ones(5)), CannotIdentify);
  EXPECT_THROW(fit_linear(Eigen::MatrixXd::Ones(2, 2), Eigen::Vector2d(1, 1)), CannotIdentify);
  EXPECT_THROW(fit_linear(Eigen::MatrixXd::Zero(5, 1), Eigen::VectorXd::Ones(5)), CannotIdentify);
}

/// The mean of y as a fit with its Jacobian.
LeastSquaresFit mean_of(const Eigen::VectorXd& y) {
  LeastSquaresFit fit = fit_linear(Eigen::MatrixXd::Ones(y.size(), 1), y);
  fit.jacobian = -Eigen::MatrixXd::Ones(y.size(), 1);
  return fit;
}

TEST(LeastSquares, BlockCovarianceKnowsThatNeighboursAgree) {
  // Noise that stays for 20 rows: white formulas state an error sqrt(20) too small.
  double sum = 0, white = 0, blocks = 0;
  constexpr int kSeeds = 200, kRows = 2000, kStay = 20;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Random generator(seed);
    Eigen::VectorXd y(kRows);
    for (int i = 0; i < kRows; i += kStay) y.segment(i, kStay).setConstant(generator.normal());
    const LeastSquaresFit fit = mean_of(y);
    sum += fit.values[0] * fit.values[0];
    white += fit.covariance(0, 0);
    blocks += block_covariance(fit, 2 * kStay)(0, 0);
  }
  EXPECT_NEAR(sum / white, kStay, 0.3 * kStay);  // three standard errors of a variance from 200 values
  EXPECT_NEAR(sum / blocks, 1, 0.3);
}

// Errors e_k = rho e_(k-1) + sqrt(1 - rho^2) noise about a mean: its variance is 1 / n (1 + rho) / (1 - rho),
// so that white formulas hold the truth with P(|Z| < 1.96 sqrt((1 - rho) / (1 + rho))), 25 % at rho = 0.95.
// Of 400 intervals, within three standard deviations of a share; those from 40 blocks may lack another 2 %.
TEST(LeastSquares, BlockCovarianceHoldsTheTruthOfAnAutoregression) {
  constexpr int kSeeds = 400, kRows = 6000, kBlock = 150;
  constexpr double kRho = 0.95;
  int white = 0, blocks = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Random generator(seed);
    Eigen::VectorXd y(kRows);
    double e = generator.normal();
    for (int i = 0; i < kRows; ++i) {
      y[i] = e;
      e = kRho * e + std::sqrt(1 - kRho * kRho) * generator.normal();
    }
    const LeastSquaresFit fit = mean_of(y);
    const auto holds = [&](double variance) { return std::fabs(fit.values[0]) < 1.96 * std::sqrt(variance); };
    white += holds(fit.covariance(0, 0));
    blocks += holds(block_covariance(fit, kBlock)(0, 0));
  }
  const double share = std::erf(1.96 * std::sqrt((1 - kRho) / (1 + kRho)) / std::sqrt(2.0));
  EXPECT_NEAR(double(white) / kSeeds, share, 3 * std::sqrt(share * (1 - share) / kSeeds));
  EXPECT_GT(double(blocks) / kSeeds, 0.93 - 3 * std::sqrt(0.05 * 0.95 / kSeeds));
}

}  // namespace
}  // namespace backlash::signal
