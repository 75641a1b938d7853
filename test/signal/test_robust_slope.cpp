// SPDX-License-Identifier: BSD-3-Clause
// Theil and Sen's slope, and how much errors that hang together widen its interval.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/error_memory.h"
#include "backlash_diagnosis/signal/sen_slope.h"

namespace backlash::signal {
namespace {

TEST(SenSlope, IsTheMedianOfAllSlopesByHand) {
  // Slopes 1 1 1 10 14.5 28.
  EXPECT_EQ(SenSlope({0, 1, 2, 3}, {0, 1, 2, 30}).value(), 5.5);
  EXPECT_EQ(SenSlope({0, 1, 2}, {0, 1, 4}).value(), 2);
}

TEST(SenSlope, IntervalOfAParabolaByHand) {
  // Slopes between x^2 at 0 ... 9 are i + j. Kendall's variance 10 * 9 * 25 / 18 = 125; of 45 slopes the
  // floor((45 - 1.96 sqrt(125)) / 2) = 11th from either end: 1 2 3 3 4 4 5 5 5 6 6 6 ...
  std::vector<double> times, values;
  for (int i = 0; i < 10; ++i) {
    times.push_back(i);
    values.push_back(i * i);
  }
  const SenSlope slope(times, values);
  EXPECT_EQ(slope.value(), 9);
  EXPECT_EQ(slope.interval(1).lower, 6);
  EXPECT_EQ(slope.interval(1).upper, 12);
  // Four times the variance: floor((45 - 43.8) / 2) = 0, too few points.
  EXPECT_TRUE(std::isnan(slope.interval(4).lower));
}

/// An autoregression x[k] = f x[k-1] + e, of which a mean has (1 + f) / (1 - f) times the variance.
ErrorMemory memory_of(double f, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> times, values;
  for (int i = 0; i < 300; ++i) {
    times.push_back(i);
    values.push_back(random.normal() + (i > 0 ? f * values.back() : 0));
  }
  return error_memory(times, values);
}

TEST(ErrorMemory, ErrorsThatAlternateHaveNone) {
  // No positive correlation makes these likelier than independence; a slow part of their size at most 1/300
  // may hide in the mean, which for half of the record multiplies the variance by 1 + 300 / 300.
  std::vector<double> times, values;
  for (int i = 0; i < 300; ++i) {
    times.push_back(i);
    values.push_back(i % 2 ? 1 : -1);
  }
  const ErrorMemory memory = error_memory(times, values);
  EXPECT_GE(memory.level, 1);
  EXPECT_LT(memory.level, 2);
  EXPECT_GE(memory.slope, 1);
  EXPECT_LT(memory.slope, 2);
}

TEST(ErrorMemory, OfAnAutoregressionWithinItsOwnError) {
  // f is known to sqrt((1 - f^2) / 300) = 0.041; four of these make 3.3 to 14 of 5.7.
  for (std::uint64_t seed = 1; seed < 6; ++seed) {
    const ErrorMemory memory = memory_of(0.7, seed);
    EXPECT_GT(memory.level, 3.3) << seed;
    EXPECT_LT(memory.level, 14) << seed;
    EXPECT_GT(memory.slope, 3.3) << seed;
    EXPECT_LT(memory.slope, 14) << seed;
  }
}

}  // namespace
}  // namespace backlash::signal
