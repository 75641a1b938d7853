// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/distributions.h"

namespace backlash::signal {
namespace {

TEST(Distributions, StudentQuantileAgreesWithTables) {
  // Two-sided 95 %, as printed in tables of the t distribution: half a unit of the last digit.
  const std::pair<double, double> table[] = {{1, 12.706}, {2, 4.303},  {4, 2.776},  {5, 2.571},
                                             {7, 2.365},  {10, 2.228}, {30, 2.042}, {120, 1.980}};
  for (const auto& [degrees, value] : table)
    EXPECT_NEAR(student_t_quantile(0.975, degrees), value, 5e-4) << degrees;
  EXPECT_NEAR(student_t_quantile(0.975, 1e9), kNormalQuantile975, 1e-6);
}

TEST(Distributions, StudentTailsInClosedForm) {
  for (const double t : {0.3, 1.0, 4.0}) {
    EXPECT_NEAR(student_t_two_sided(t, 1), 1 - 2 / M_PI * std::atan(t), 1e-14);
    EXPECT_NEAR(student_t_two_sided(-t, 2), 1 - t / std::sqrt(2 + t * t), 1e-14);
  }
  EXPECT_EQ(student_t_two_sided(INFINITY, 3), 0);
  EXPECT_TRUE(std::isnan(student_t_two_sided(NAN, 3)));
}

TEST(Distributions, ChiSquareOfTwoDegreesIsExponential) {
  for (const double p : {0.01, 0.5, 0.999}) {
    EXPECT_NEAR(chi_square_quantile(p, 2), -2 * std::log1p(-p), 1e-12);
    EXPECT_NEAR(chi_square_probability(-2 * std::log1p(-p), 2), p, 1e-14);
  }
}

TEST(Distributions, ChiSquareAgreesWithTables) {
  EXPECT_NEAR(chi_square_quantile(0.2, 10), 6.179, 5e-4);
  EXPECT_NEAR(chi_square_quantile(0.2, 6), 3.070, 5e-4);
  EXPECT_NEAR(chi_square_quantile(0.95, 1), kNormalQuantile975 * kNormalQuantile975, 1e-12);
}

TEST(Distributions, RefuseWhatTheyAreNotDefinedFor) {
  EXPECT_THROW(student_t_quantile(0.975, 0), InvalidParameter);
  EXPECT_THROW(student_t_quantile(1, 3), InvalidParameter);
  EXPECT_THROW(student_t_two_sided(1, NAN), InvalidParameter);
  EXPECT_THROW(chi_square_quantile(0, 3), InvalidParameter);
  EXPECT_THROW(chi_square_probability(-1, 3), InvalidParameter);
}

}  // namespace
}  // namespace backlash::signal
