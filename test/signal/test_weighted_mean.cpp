// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/signal/weighted_mean.h"

namespace backlash::signal {
namespace {

TEST(WeightedMean, ErrorsHoldHowFarTheValuesDiffer) {
  const WeightedMean one = weighted_mean({{3, 0.5}});
  EXPECT_EQ(one.value, 3);
  EXPECT_EQ(one.standard_error, 0.5);
  EXPECT_EQ(one.chance, 1);
  // Three that differ by their errors: chi^2 is 2 of 2 degrees, whose chance is exp(-1).
  const WeightedMean alike = weighted_mean({{9, 1}, {10, 1}, {11, 1}});
  EXPECT_DOUBLE_EQ(alike.value, 10);
  EXPECT_NEAR(alike.standard_error, 1 / std::sqrt(3), 1e-12);
  EXPECT_NEAR(alike.chance, std::exp(-1), 1e-9);
  // By four errors, and twice as sure of the first: the mean at 1/5, chi^2 = (0.8 / 0.5)^2 + 3.2^2.
  const WeightedMean apart = weighted_mean({{10, 0.5}, {14, 1}});
  EXPECT_DOUBLE_EQ(apart.value, 10.8);
  EXPECT_NEAR(apart.standard_error, std::sqrt(1.6 * 1.6 + 3.2 * 3.2) / std::sqrt(5), 1e-12);
  EXPECT_NEAR(apart.chance, std::erfc(std::sqrt(0.5 * (1.6 * 1.6 + 3.2 * 3.2))), 1e-9);
}

}  // namespace
}  // namespace backlash::signal
