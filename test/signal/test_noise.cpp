// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/noise.h"
#include "support/waves.h"

namespace backlash::signal {
namespace {

using test::kWaves;
using test::sample;
using test::Signal;

/// Five standard errors (relative) of the noise estimate from `blocks` stretches. The 20 % quantile of n
/// values with density f there scatters by sqrt(0.2 0.8 / n) / f; the root halves the relative error. From
/// period to period: chi-square with 10 degrees, f(6.179) = 0.0864, and neighbouring periods share samples,
/// which raises the variance by at most 1.5. Within a period: 6 degrees, f(3.070) = 0.127. The larger of the
/// two.
double five_errors(double blocks) {
  return 5 * std::sqrt(0.16 / blocks) / 2 * std::max(std::sqrt(1.5) / 0.0864 / 6.179, 1 / 0.127 / 3.070);
}

TEST(EstimateNoise, KnownWhiteNoiseOnAnyWave) {
  for (const auto& [name, wave] : kWaves)
    for (const double noise : {1e-3, 0.03, 0.5}) {
      const Signal signal = sample(wave, 60, 200, noise);
      const NoiseRange found = estimate_noise(signal.value, 200);
      EXPECT_NEAR(found.upper / noise, 1, five_errors(59 * 20)) << name << ' ' << noise;
      EXPECT_EQ(found.lower, found.upper) << name << ' ' << noise;
    }
}

TEST(EstimateNoise, OfAFewPeriods) {
  const Signal signal = sample(kWaves[0].second, 2, 500, 0.1);
  EXPECT_NEAR(estimate_noise(signal.value, 500).upper / 0.1, 1, five_errors(50));
}

TEST(EstimateNoise, OfASinglePeriodOnlyABound) {
  const Signal slow = sample(kWaves[0].second, 1, 5000, 0.1);
  EXPECT_NEAR(estimate_noise(slow.value, 5000).upper / 0.1, 1,
              five_errors(500));  // 10 samples are a small part of a sine
  EXPECT_EQ(estimate_noise(slow.value, 5000).lower, 0);
  const Signal fast =
      sample(kWaves[0].second, 100, 5, 0.1);  // a cubic cannot follow it, and no period has 10 samples
  EXPECT_GT(estimate_noise(fast.value, 5).upper, 0.1);
  EXPECT_EQ(estimate_noise(fast.value, 5).lower, 0);
}

TEST(EstimateNoise, WithoutNoise) {
  // The ringing has 20 samples per cycle: only the differences between periods, which vanish, show that it is
  // no noise.
  EXPECT_LT(estimate_noise(sample(kWaves[6].second, 20, 200).value, 200).upper, 1e-12);
}

TEST(EstimateNoise, MotionThatRepeatsPartOfTheTime) {
  // Ringing of random size over three quarters of each period, fast against ten samples: the calmest fifth of
  // all is four fifths of the calm quarter. From period to period the estimate is too high by the root of the
  // 80 % (13.442) over the 20 % quantile (6.179) of chi-square with 10 degrees, within a period by that
  // of 8.558 over 3.070 (6 degrees).
  Random random(3);
  std::vector<double> signal;
  double size = 0;
  for (int i = 0; i < 20000; ++i) {
    if (i % 200 == 0) size = random.normal();
    signal.push_back((i % 200 < 150 ? size * std::sin(2.1 * i) : 0) + 0.01 * random.normal());
  }
  const NoiseRange found = estimate_noise(signal, 200);
  EXPECT_NEAR(found.upper / 0.01, std::sqrt(13.442 / 6.179), 0.1);  // five errors, about 500 stretches
  EXPECT_EQ(found.lower, 0);  // most of the differences are larger than noise of that size explains
}

// Ringing that never repeats, everywhere: its differences are no white noise, and must not be taken for it.
TEST(EstimateNoise, ChaoticRingingIsNoNoise) {
  Random random(4);
  for (const double cycle : {0.4, 1.3})  // rad per sample
    for (const double noise : {0.0, 0.01}) {
      std::vector<double> signal;
      double size = 0, phase = 0;
      for (int i = 0; i < 20000; ++i) {
        if (i % 100 == 0) size = 1 + 0.3 * random.normal(), phase = random.normal();
        signal.push_back(size * std::sin(cycle * i + phase) + noise * random.normal());
      }
      const NoiseRange found = estimate_noise(signal, 200);
      EXPECT_LT(found.upper, 0.03) << cycle << ' '
                                   << noise;  // the ringing itself has a standard deviation of 0.7
      EXPECT_GE(found.upper, 0.9 * noise) << cycle;
      EXPECT_LE(found.lower, 1.1 * noise) << cycle;
    }
}

TEST(EstimateNoise, TooShortForAnEstimate) {
  EXPECT_TRUE(std::isnan(estimate_noise({}, 100).upper));
  EXPECT_TRUE(std::isnan(estimate_noise(std::vector<double>(9, 1.0), 100).upper));
  const Signal signal = sample(kWaves[0].second, 3, 100, 0.1);
  const std::vector<double> almost_two(signal.value.begin(), signal.value.begin() + 199);
  EXPECT_EQ(estimate_noise(almost_two, 100).lower, 0);
  for (const double per_period :
       {0.0, 5.0, -100.0, 1e300, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(estimate_noise(signal.value, per_period).lower, 0) << per_period;
    EXPECT_GT(estimate_noise(signal.value, per_period).upper, 0.05) << per_period;
  }
}

TEST(EstimateNoise, LeavesOutValuesThatAreNotFinite) {
  Signal signal = sample(kWaves[0].second, 60, 200, 0.1);
  signal.value[500] = std::nan("");
  signal.value[5000] = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(estimate_noise(signal.value, 200).upper / 0.1, 1, five_errors(59 * 20));
}

TEST(Noise, StandardErrorHoldsTheTruth) {
  int held = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    Random random(seed);
    std::vector<double> signal;
    for (int i = 0; i < 500; ++i) signal.push_back(std::sin(2 * M_PI * i / 100.0) + 0.01 * random.normal());
    const NoiseRange range = with_standard_error(estimate_noise(signal, 100), signal.size());
    held += range.lower <= 0.01 && 0.01 <= range.upper;
  }
  // Two standard errors hold 95 %, 190 of 200 +- 3; four of these.
  EXPECT_GE(held, 178);
}

TEST(Differences, ByHand) {
  EXPECT_EQ(differences({1, 4, 9, 16, 25}, 1), (std::vector<double>{3, 5, 7, 9}));
  EXPECT_EQ(differences({1, 4, 9, 16, 25}, 2), (std::vector<double>{2, 2, 2}));
  EXPECT_TRUE(differences({1, 2}, 2).empty());
}

TEST(NoiseFromDifferences, OfAnAlternatingSignalByHand) {
  // Every difference of order n is 2^n.
  const std::vector<double> x = {1, -1, 1, -1, 1, -1, 1, -1};
  const double per_median = 1.482602218505602, variance[] = {2, 6, 20, 70};
  for (int order = 1; order <= 4; ++order)
    EXPECT_NEAR(noise_from_differences(x, order),
                per_median * std::pow(2, order) / std::sqrt(variance[order - 1]), 1e-12);
  EXPECT_TRUE(std::isnan(noise_from_differences({1, 2, 3}, 3)));
}

TEST(NoiseFromDifferences, LeavesACubicAndAJumpOut) {
  Random random(8);
  std::vector<double> x;
  for (int i = 0; i < 40000; ++i)
    x.push_back(std::pow(1e-2 * i, 3) + (i > 20000 ? 1000 : 0) + 0.5 * random.normal());
  // A median of n normal sizes is known to 1 / sqrt(0.74 n), 0.6 %; fourth differences overlap by five.
  EXPECT_NEAR(noise_from_differences(x, 4), 0.5, 5 * 0.5 * 0.006 * std::sqrt(5.0));
}

}  // namespace
}  // namespace backlash::signal
