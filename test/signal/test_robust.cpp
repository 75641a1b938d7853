// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "backlash_diagnosis/signal/order_statistics.h"
#include "backlash_diagnosis/signal/robust.h"

namespace backlash {
namespace {

TEST(Robust, OutlierIsCountedAndClipped) {
  const RobustScale scale = robust_scale({-2, -1, 0, 1, 2, 1000}, 0.1);
  // Median 0.5, distances 2.5 1.5 0.5 0.5 1.5 999.5, their median 1.5.
  EXPECT_EQ(scale.centre, 0.5);
  EXPECT_EQ(scale.outliers, 1u);
  EXPECT_NEAR(scale.clip, 3.5 * 1.482602218505602 * 1.5 + 0.1, 1e-12);
  EXPECT_NEAR(scale.deviation, std::sqrt((6.25 + 2.25 + 0.25 + 0.25 + 2.25 + scale.clip * scale.clip) / 5),
              1e-12);
}

TEST(Robust, EqualValuesHaveNoScale) {
  const RobustScale scale = robust_scale({7, 7, 7}, 0);
  EXPECT_EQ(scale.deviation, 0);
  EXPECT_EQ(scale.outliers, 0u);
}

TEST(Robust, StudentQuantileAgreesWithTables) {
  // Two-sided 95 %, as printed in tables of the t distribution.
  const std::pair<std::size_t, double> table[] = {{1, 12.706}, {2, 4.303},  {4, 2.776},  {5, 2.571},
                                                  {7, 2.365},  {10, 2.228}, {30, 2.042}, {120, 1.980}};
  // The documented error of the expansion is 0.3 %, that of the table half a unit of the last digit.
  for (const auto& [degrees, value] : table)
    EXPECT_NEAR(student_t_975(degrees), value, 0.003 * value) << degrees;
  EXPECT_NEAR(student_t_975(1000000), 1.95996, 1e-4);
}

}  // namespace
}  // namespace backlash
