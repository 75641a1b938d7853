// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/robust.h"
#include "backlash_diagnosis/signal/robust_mean.h"

namespace backlash::signal {
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

TEST(RobustMean, OneWrongValueAmongEqualOnesIsNamed) {
  const RobustMean mean = robust_mean({{2, 0.1}, {2, 0.1}, {2, 0.1}, {50, 0.1}, {2, 0.1}});
  EXPECT_NEAR(mean.value, 2, 1e-6);
  EXPECT_EQ(mean.outliers, std::vector<std::size_t>{3});
  EXPECT_GE(mean.standard_error, 0.1 / std::sqrt(5));  // never below what the errors allow
}

TEST(RobustMean, NothingHasNoMeanAndOneValueIsItsOwn) {
  EXPECT_THROW(robust_mean({}), CannotIdentify);
  EXPECT_EQ(robust_mean({{3, 0.5}}).standard_error, 0.5);
}

}  // namespace
}  // namespace backlash::signal
