// SPDX-License-Identifier: BSD-3-Clause
// The probability against sums of normal numbers that the test draws.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "changes/onset_threshold.h"

namespace backlash::changes {
namespace {

constexpr int kLooks = 30000, kFewest = 2, kMost = 75;

/// Of so many looks at healthy windows those whose largest gain over the onsets is beyond `gain`.
int looks_beyond(double gain, int values) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  int beyond = 0;
  for (int look = 0; look < kLooks; ++look) {
    double sums[2] = {}, most = 0;
    for (int m = 1; m <= kMost; ++m) {
      double squares = 0;
      for (int i = 0; i < values; ++i) {
        sums[i] += normal(random);
        squares += sums[i] * sums[i];
      }
      if (m >= kFewest) most = std::max(most, squares / m);
    }
    beyond += most > gain;
  }
  return beyond;
}

TEST(OnsetThreshold, IsExceededAsOftenAsItSays) {
  for (const int values : {1, 2})
    for (const double probability : {0.1, 0.03, 0.01}) {
      const double expected = probability * kLooks;
      // The approximation's 10 %, and three standard deviations of the count.
      EXPECT_NEAR(looks_beyond(gain_by_chance(probability, values, kFewest, kMost), values), expected,
                  0.1 * expected + 3 * std::sqrt(expected))
          << values << " " << probability;
    }
}

TEST(OnsetThreshold, IsThatOfOneOnsetWhereThereIsOne) {
  // P(chi^2 of one degree > x) = erfc(sqrt(x / 2))
  EXPECT_NEAR(chance_of_gain(9, 1, 10, 10), std::erfc(std::sqrt(4.5)), 1e-12);
}

}  // namespace
}  // namespace backlash::changes
