// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::signal {
namespace {

TEST(OrderStatistics, MedianByHand) {
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 2, 3}), 2.5);
  EXPECT_TRUE(std::isnan(median({})));
  EXPECT_EQ(median_magnitude({-3, 1, 2}), 2);
}

TEST(OrderStatistics, QuantileIsLinearBetweenNeighbours) {
  EXPECT_EQ(quantile({5, 1, 4, 2, 3}, 0.25), 2);
  EXPECT_EQ(quantile({5, 1, 4, 2, 3}, 1), 5);
  EXPECT_EQ(quantile({5, 1, 4, 2, 3}, 0), 1);
  // numpy.quantile([10, 20, 40], 0.9): place 1.8, 20 + 0.8 * 20
  EXPECT_NEAR(quantile({40, 10, 20}, 0.9), 36, 1e-12);
  EXPECT_EQ(quantile({7}, 0.3), 7);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(OrderStatistics, RangesByHand) {
  // Of 0 to 100 the places 1 and 99.
  std::vector<double> values;
  for (int k = 100; k >= 0; --k) values.push_back(k);
  EXPECT_NEAR(quantile_range(values, 0.01), 98, 1e-12);
  EXPECT_EQ(peak_to_peak(values), 100);
  EXPECT_EQ(peak_to_peak({}), 0);
  const Extent whole = extent({3, -1, 7, 2}), part = extent({3, -1, 7, 2}, 2, 4);
  EXPECT_EQ(std::tie(whole.low, whole.high), std::make_tuple(-1, 7));
  EXPECT_EQ(std::tie(part.low, part.high), std::make_tuple(2, 7));
  EXPECT_EQ(smallest_step({1, 1, 1.5, 1.25, 4}), 0.25);
  EXPECT_EQ(smallest_step({2, 2}), 0);
  EXPECT_EQ(smallest_step({0, 1e-12, 2, 1}, 1e-9), 1);
}

}  // namespace
}  // namespace backlash::signal
