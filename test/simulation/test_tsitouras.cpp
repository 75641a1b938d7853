// SPDX-License-Identifier: BSD-3-Clause
// The coefficients, against the conditions that make a Runge-Kutta pair one of order 5(4) (Butcher 2008,
// Table 302(I)).
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "../../src/simulation/tsitouras.h"

namespace backlash::simulation {
namespace {

using namespace tsitouras;
using Stages = Eigen::Matrix<double, kStages, 1>;

// Coefficients are given to 16 digits and up to 13 large.
constexpr double kRounding = 1e-13;

struct Pair {
  Eigen::Matrix<double, kStages, kStages> a;
  Stages c, b, error;

  Pair() {
    for (int i = 0; i < kStages; ++i) {
      for (int j = 0; j < kStages; ++j) a(i, j) = kA[i][j];
      c[i] = kC[i], b[i] = kA[kStages - 1][i], error[i] = kError[i];
    }
  }

  /// Of weights that go to a share u of the step.
  void expect_order_4(const Stages& weights, double u) const {
    const Stages one = Stages::Ones(), c2 = c.cwiseProduct(c), c3 = c2.cwiseProduct(c), ac = a * c;
    EXPECT_NEAR(weights.dot(one), u, kRounding);
    EXPECT_NEAR(weights.dot(c), std::pow(u, 2) / 2, kRounding);
    EXPECT_NEAR(weights.dot(c2), std::pow(u, 3) / 3, kRounding);
    EXPECT_NEAR(weights.dot(ac), std::pow(u, 3) / 6, kRounding);
    EXPECT_NEAR(weights.dot(c3), std::pow(u, 4) / 4, kRounding);
    EXPECT_NEAR(weights.dot(c.cwiseProduct(ac)), std::pow(u, 4) / 8, kRounding);
    EXPECT_NEAR(weights.dot(a * c2), std::pow(u, 4) / 12, kRounding);
    EXPECT_NEAR(weights.dot(a * ac), std::pow(u, 4) / 24, kRounding);
  }
};

TEST(Tsitouras, StagesAreConsistent) {
  const Pair p;
  EXPECT_NEAR((p.a.rowwise().sum() - p.c).cwiseAbs().maxCoeff(), 0, kRounding);
  EXPECT_EQ(p.c[kStages - 1], 1);
  EXPECT_NE(p.error[kStages - 1], 0) << "the end of the step must count: a flank may be met there alone";
}

TEST(Tsitouras, SolutionIsOfOrderFive) {
  const Pair p;
  p.expect_order_4(p.b, 1);
  const Stages c2 = p.c.cwiseProduct(p.c), c3 = c2.cwiseProduct(p.c), ac = p.a * p.c, ac2 = p.a * c2;
  EXPECT_NEAR(p.b.dot(c2.cwiseProduct(c2)), 1 / 5.0, kRounding);
  EXPECT_NEAR(p.b.dot(c2.cwiseProduct(ac)), 1 / 10.0, kRounding);
  EXPECT_NEAR(p.b.dot(ac.cwiseProduct(ac)), 1 / 20.0, kRounding);
  EXPECT_NEAR(p.b.dot(p.c.cwiseProduct(ac2)), 1 / 15.0, kRounding);
  EXPECT_NEAR(p.b.dot(p.a * c3), 1 / 20.0, kRounding);
  EXPECT_NEAR(p.b.dot(p.c.cwiseProduct(p.a * ac)), 1 / 30.0, kRounding);
  EXPECT_NEAR(p.b.dot(p.a * p.c.cwiseProduct(ac)), 1 / 40.0, kRounding);
  EXPECT_NEAR(p.b.dot(p.a * ac2), 1 / 60.0, kRounding);
  EXPECT_NEAR(p.b.dot(p.a * (p.a * ac)), 1 / 120.0, kRounding);
}

TEST(Tsitouras, TheOtherSolutionIsOfOrderFour) {
  const Pair p;
  p.expect_order_4(p.b - p.error, 1);
}

TEST(Tsitouras, InterpolantIsOfOrderFourAndEndsAtTheSolution) {
  const Pair p;
  for (const double u : {0.0, 0.1, 0.37, 0.5, 0.83, 1.0}) {
    double weights[kStages];
    interpolant(u, weights);
    p.expect_order_4(Stages(weights), u);
    if (u < 1) continue;
    EXPECT_NEAR((Stages(weights) - p.b).cwiseAbs().maxCoeff(), 0, kRounding);
  }
}

}  // namespace
}  // namespace backlash::simulation
