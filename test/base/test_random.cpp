// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "backlash_diagnosis/base/random.h"

namespace backlash {
namespace {

TEST(Random, BitsAreThoseOfTheMersenneTwister) {
  // The C++ standard fixes the 10000th number of the default seed.
  Random random(5489);
  std::uint64_t bits = 0;
  for (int i = 0; i < 10000; ++i) bits = random.bits();
  EXPECT_EQ(bits, 9981545732273789042ULL);
}

TEST(Random, StreamsAreThoseOfTheStandardSeedSequence) {
  std::seed_seq sequence{7u, 1u, 3u};
  std::mt19937_64 engine(sequence);
  Random random((std::uint64_t(1) << 32) + 7, 3);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(random.bits(), engine());
}

TEST(Random, MomentsAreThoseOfTheDistributions) {
  constexpr int n = 200000;
  Random random(1);
  double uniform = 0, square = 0, fourth = 0;
  std::vector<int> counts(5, 0);
  for (int i = 0; i < n; ++i) {
    const double u = random.uniform(), x = random.normal();
    ASSERT_TRUE(u >= 0 && u < 1);
    uniform += u / n;
    square += x * x / n;
    fourth += std::pow(x, 4) / n;
    ++counts.at(random.below(5));
  }
  EXPECT_NEAR(uniform, 0.5, 5 * std::sqrt(1.0 / 12 / n));
  EXPECT_NEAR(square, 1, 5 * std::sqrt(2.0 / n));
  EXPECT_NEAR(fourth, 3, 5 * std::sqrt(96.0 / n));
  for (const int count : counts) EXPECT_NEAR(count, n * 0.2, 5 * std::sqrt(n * 0.2 * 0.8));
}

}  // namespace
}  // namespace backlash
