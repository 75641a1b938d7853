// SPDX-License-Identifier: BSD-3-Clause
// Fits whose answers have closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/fit/nonlinear.h"

namespace backlash::fit {
namespace {

/// Residuals of y = exp(-k t) + c at hundred times.
ResidualFunction decay(const Eigen::VectorXd& data) {
  return [data](const Eigen::VectorXd& p) {
    if (p[0] < 0) throw InvalidParameter("k", p[0], "must be >= 0");
    Eigen::VectorXd r(data.size());
    for (Eigen::Index i = 0; i < r.size(); ++i) r[i] = data[i] - std::exp(-p[0] * 0.05 * i) - p[1];
    return r;
  };
}

TEST(Nonlinear, FindsTheExactParameters) {
  Eigen::VectorXd data(100);
  for (int i = 0; i < 100; ++i) data[i] = std::exp(-1.7 * 0.05 * i) + 0.3;
  const signal::LeastSquaresFit fit =
      fit_nonlinear(decay(data), Eigen::Vector2d(0.2, 0), Eigen::Vector2d(1, 1));
  EXPECT_NEAR(fit.values[0], 1.7, 1e-6);
  EXPECT_NEAR(fit.values[1], 0.3, 1e-6);
}

/// Residuals of a line through x = 0 .. 3, y = 1, 2, 2, 4.
Eigen::VectorXd line(const Eigen::VectorXd& p) {
  return Eigen::Vector4d(1 - p[0], 2 - p[0] - p[1], 2 - p[0] - 2 * p[1], 4 - p[0] - 3 * p[1]);
}

TEST(Nonlinear, OfALineItIsTheClosedForm) {
  // Slope 0.9, intercept 0.9, squares 0.7, variance 0.35; s.e. sqrt(0.35 * 14/20), sqrt(0.35/5).
  for (const bool central : {false, true}) {
    NonlinearOptions options;
    options.central = central;
    const signal::LeastSquaresFit fit =
        fit_nonlinear(line, Eigen::Vector2d(5, -7), Eigen::Vector2d(1, 100), options);
    EXPECT_TRUE(fit.converged);
    EXPECT_NEAR(fit.values[0], 0.9, 1e-6);
    EXPECT_NEAR(fit.values[1], 0.9, 1e-6);
    EXPECT_NEAR(fit.deviation, std::sqrt(0.35), 1e-6);
    EXPECT_NEAR(fit.parameter(0).standard_error, std::sqrt(0.35 * 0.7), 1e-6);
    EXPECT_NEAR(fit.parameter(1).standard_error, std::sqrt(0.07), 1e-6);
  }
}

TEST(Nonlinear, OnAllProcessorsItIsTheSameAndPointsAreAnnounced) {
  constexpr int kSize = 20;  // more than are announced at once
  const ResidualFunction f = [](const Eigen::VectorXd& p) {
    return Eigen::VectorXd(p.array().exp() - Eigen::ArrayXd::LinSpaced(kSize, 1, 3));
  };
  const Eigen::VectorXd start = Eigen::VectorXd::Zero(kSize), scale = Eigen::VectorXd::Ones(kSize);
  NonlinearOptions options;
  options.central = true;
  const signal::LeastSquaresFit alone = fit_nonlinear(f, start, scale, options);
  std::size_t most = 0;
  options.parallel = true;
  options.ahead = [&](const std::vector<Eigen::VectorXd>& points) { most = std::max(most, points.size()); };
  const signal::LeastSquaresFit together = fit_nonlinear(f, start, scale, options);
  EXPECT_EQ(alone.values, together.values);
  EXPECT_EQ(most, std::size_t(kPointsAtOnce));
}

// A value that acts in steps, as where an encoder hides what is smaller.
TEST(Nonlinear, WideStepsToBothSidesLeadOverStumbles) {
  constexpr double kStep = 1e-3;
  const ResidualFunction f = [](const Eigen::VectorXd& p) {
    return Eigen::VectorXd(Eigen::Vector3d(1, 2, 3) * (kStep * std::round(p[0] / kStep) - 1.7));
  };
  const Eigen::VectorXd start = Eigen::VectorXd::Ones(1), scale = Eigen::VectorXd::Ones(1);
  EXPECT_THROW(fit_nonlinear(f, start, scale), CannotIdentify);
  NonlinearOptions options;
  options.step = 1e-2;
  options.central = true;
  EXPECT_NEAR(fit_nonlinear(f, start, scale, options).values[0], 1.7, kStep);
}

TEST(Nonlinear, WhatIsRefusedIsTooFar) {
  // Nothing beyond 1 is allowed, where the least squares lie.
  const ResidualFunction f = [](const Eigen::VectorXd& p) {
    if (p[0] > 1) throw InvalidParameter("p", p[0], "must be <= 1");
    return line(p);
  };
  const signal::LeastSquaresFit fit = fit_nonlinear(f, Eigen::Vector2d(1, 0), Eigen::Vector2d(1, 1));
  // Squares of 0.7 (1 + 1e-6), where it may end, are 1.4e-3 standard errors of 0.495 from their least.
  EXPECT_NEAR(fit.values[0], 0.9, 7e-4);
  EXPECT_THROW(fit_nonlinear(f, Eigen::Vector2d(2, 0), Eigen::Vector2d(1, 1)), Error);
}

}  // namespace
}  // namespace backlash::fit
