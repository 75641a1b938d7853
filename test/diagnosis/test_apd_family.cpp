// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/apd_family.h"

namespace backlash::diagnosis {
namespace {

TEST(Quantiles, OfEvenlySpacedSamples) {
  std::vector<double> samples;
  for (int i = 0; i < 1000; ++i) samples.push_back((i * 7) % 1000);  // 0 .. 999 in another order
  const Quantiles q = quantiles_of(samples);
  ASSERT_EQ(q.size(), std::size_t{kQuantiles});
  for (int k = 0; k < kQuantiles; ++k) EXPECT_NEAR(q[k], 10 * k + 4.5, 1e-9);  // middle of the k-th ten
  EXPECT_EQ(quantiles_of({3.0}), Quantiles(kQuantiles, 3.0));
  EXPECT_THROW(quantiles_of({}), InvalidParameter);
}

TEST(WithNoise, OfAConstantIsTheNormalDistribution) {
  const Quantiles q = with_noise(Quantiles(kQuantiles, 2.0), 0.5);
  // Quantiles of the normal distribution at 0.005, 0.025 (Abramowitz and Stegun, Table 26.5) and 0.495; a
  // grid of a quarter of sigma, interpolated linearly, errs by up to 2 % of sigma in the tails.
  EXPECT_NEAR(q[0], 2 - 0.5 * 2.5758, 0.01);
  EXPECT_NEAR(q[2], 2 - 0.5 * 1.9600, 0.01);
  EXPECT_NEAR(q[99], 2 + 0.5 * 2.5758, 0.01);
  EXPECT_NEAR(q[49], 2 - 0.5 * 0.01253, 0.01);
  EXPECT_TRUE(std::is_sorted(q.begin(), q.end()));
}

TEST(WithNoise, KeepsMeanAndAddsVariance) {
  Quantiles exact(kQuantiles);
  for (int k = 0; k < kQuantiles; ++k) exact[k] = (k + 0.5) / kQuantiles;  // uniform on [0, 1]
  for (const double sigma : {1e-4, 0.01, 0.1, 1.0}) {
    const Quantiles q = with_noise(exact, sigma);
    double mean = 0, square = 0;
    for (const double v : q) mean += v / kQuantiles;
    for (const double v : q) square += (v - mean) * (v - mean) / kQuantiles;
    EXPECT_NEAR(mean, 0.5, 1e-3 * (1 + sigma));
    // 1/12 + sigma^2, of which 100 quantiles lose the tails beyond 0.5 %: 3 % of the normal part.
    EXPECT_NEAR(square, 1 / 12.0 + sigma * sigma, 1e-4 + 0.03 * sigma * sigma);
  }
  EXPECT_EQ(with_noise(exact, 0), exact);
}

/// Members that are one distribution shifted: by `step` from one backlash to the next, by `shift` per phase.
ApdFamily shifted(int count, int phases, double step, double shift) {
  ApdFamily family;
  family.members.resize(count);
  for (int i = 0; i < count; ++i)
    for (int phase = 0; phase < phases; ++phase) {
      Quantiles q(kQuantiles);
      for (int k = 0; k < kQuantiles; ++k) q[k] = 0.01 * k + step * i + shift * phase;
      family.members[i].push_back(q);
    }
  return family;
}

TEST(FamilyDistance, OfShiftedDistributionsIsTheSquareOfTheShift) {
  const ApdFamily family = shifted(5, 1, 1.0, 0);
  Quantiles observed = family.members[2][0];
  for (double& v : observed) v += 0.25;  // a quarter of the way to the next member
  const FamilyDistance distance(NoisyFamily(family, 0), observed);
  EXPECT_EQ(distance.smallest().segment, 2u);
  EXPECT_NEAR(distance.smallest().share, 0.25, 1e-12);  // rounding, as all below
  EXPECT_NEAR(distance.smallest().distance, 0, 1e-12);
  for (std::size_t i = 0; i < 4; ++i)
    for (const double share : {0.0, 0.3, 1.0})
      EXPECT_NEAR(distance.at(i, share), std::pow(i + share - 2.25, 2), 1e-12);
  const auto inside = distance.within(2, 0.01);
  ASSERT_EQ(inside.size(), 1u);
  EXPECT_NEAR(inside[0].first, 0.15, 1e-9);
  EXPECT_NEAR(inside[0].second, 0.35, 1e-9);
  EXPECT_TRUE(distance.within(0, 0.01).empty());
}

// By the definition, at records that lie anywhere.
TEST(FamilyDistance, IsTheMeanSquareDifference) {
  const ApdFamily family = shifted(4, 3, 0.02, 0.005);
  Quantiles observed(kQuantiles);
  for (int k = 0; k < kQuantiles; ++k) observed[k] = 5 + std::sin(0.1 * k);
  for (const double sigma : {0.0, 0.1}) {
    const FamilyDistance distance(NoisyFamily(family, sigma), observed);
    for (std::size_t i = 0; i + 1 < family.members.size(); ++i) {
      double nearest = INFINITY;
      for (std::size_t phase = 0; phase < 3; ++phase) {
        const Quantiles from = with_noise(family.members[i][phase], sigma),
                        to = with_noise(family.members[i + 1][phase], sigma);
        double sum = 0;
        for (int k = 0; k < kQuantiles; ++k) sum += std::pow(observed[k] - (0.6 * from[k] + 0.4 * to[k]), 2);
        nearest = std::min(nearest, sum / kQuantiles);
      }
      EXPECT_NEAR(distance.at(i, 0.4), nearest, 1e-12 * nearest);
    }
  }
}

TEST(FamilyDistance, TakesTheNearestPhase) {
  const ApdFamily family = shifted(3, 4, 1.0, 0.1);
  Quantiles observed = family.members[1][3];  // as the first phase would show it 0.3 further
  const FamilyDistance distance(NoisyFamily(family, 0), observed);
  EXPECT_NEAR(distance.smallest().distance, 0, 1e-12);
  EXPECT_NEAR(distance.at(0, 1.0), 0, 1e-12);
  EXPECT_NEAR(distance.at(1, 0.3), 0, 1e-12);        // by the first phase
  EXPECT_NEAR(distance.at(1, 0.15), 0.0025, 1e-12);  // between phases 1 (0.2 away) and 2 (0.1): 0.05 both
}

TEST(NoisyFamilies, KeepsWhatRecordsWereComparedWithLately) {
  const ApdFamily family = shifted(4, 3, 0.02, 0.005), copy = family;
  const auto first = family.compared->at(family, 0.1);
  EXPECT_EQ(family.compared->at(family, 0.1001), first);
  EXPECT_EQ(copy.compared->at(copy, 0.1), first);
  EXPECT_NE(family.compared->at(family, 0.12), first);
  EXPECT_NE(family.compared->at(family, 0), first);
  for (int i = 0; i < 1000; ++i) family.compared->at(family, 0.2 * std::pow(1.05, i % 100));
  EXPECT_EQ(first.use_count(), 1);  // not for ever
  EXPECT_NE(family.compared->at(family, 0.1), first);
  EXPECT_NE(shifted(4, 3, 0.02, 0.005).compared, family.compared);
}

// Levels are 3 % apart: noise is off by half of that at most, and so are the distances' roots, in its unit.
TEST(NoisyFamilies, DistancesAreThoseOfTheExactNoise) {
  const ApdFamily family = shifted(4, 3, 0.02, 0.005);
  const Quantiles observed = with_noise(family.members[2][1], 0.3);
  for (double sigma = 0.05; sigma < 0.5; sigma *= 1.07) {
    const FamilyDistance near(*family.compared->at(family, sigma), observed),
        exact(NoisyFamily(family, sigma), observed);
    for (std::size_t i = 0; i + 1 < family.members.size(); ++i)
      EXPECT_NEAR(std::sqrt(near.at(i, 0.5)), std::sqrt(exact.at(i, 0.5)), 0.016 * sigma) << sigma;
  }
  const FamilyDistance none(*family.compared->at(family, 0), family.members[1][0]);
  EXPECT_NEAR(none.smallest().distance, 0, 1e-12);  // rounding
}

}  // namespace
}  // namespace backlash::diagnosis
