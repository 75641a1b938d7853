// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/signal/quadratic.h"

namespace backlash::signal {
namespace {

using Intervals = std::vector<std::pair<double, double>>;

TEST(NotPositive, SolutionsByHand) {
  EXPECT_EQ(quadratic_at_most_zero(0, 0, -1), (Intervals{{0, 1}}));       // always
  EXPECT_EQ(quadratic_at_most_zero(0, 0, 1), Intervals{});                // never
  EXPECT_EQ(quadratic_at_most_zero(0, 2, -1), (Intervals{{0, 0.5}}));     // a line
  EXPECT_EQ(quadratic_at_most_zero(1, 0, -0.25), (Intervals{{0, 0.5}}));  // x^2 <= 1/4
  EXPECT_EQ(quadratic_at_most_zero(8, -6, 1), (Intervals{{0.25, 0.5}}));  // (4x - 1)(2x - 1) <= 0
  EXPECT_EQ(quadratic_at_most_zero(-8, 6, -1), (Intervals{{0, 0.25}, {0.5, 1}}));
  EXPECT_EQ(quadratic_at_most_zero(1, 0, 1), Intervals{});  // no roots, above zero
}

}  // namespace
}  // namespace backlash::signal
