// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/spectrum.h"

namespace backlash::signal {
namespace {

std::vector<double> white(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> x(count);
  for (double& v : x) v = random.normal();
  return x;
}

TEST(FourierTransform, OfACosineAndASineIsOneLine) {
  constexpr std::size_t n = 24;
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i)
    x[i] = std::cos(2 * M_PI * 3 * double(i) / n) + 0.5 * std::sin(2 * M_PI * 5 * double(i) / n) + 2;
  const auto lines = fourier_transform(x);
  ASSERT_EQ(lines.size(), n / 2 + 1);
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const std::complex<double> expected(k == 0 ? 2.0 * n : k == 3 ? n / 2.0 : 0, k == 5 ? -0.25 * n : 0);
    EXPECT_LT(std::abs(lines[k] - expected), 1e-12) << k;
  }
}

TEST(FourierTransform, OfAnyLengthIsTheSum) {
  for (const std::size_t n : {5u, 14u}) {
    const std::vector<double> x = white(n, 3);
    const auto lines = fourier_transform(x);
    ASSERT_EQ(lines.size(), n / 2 + 1);
    for (std::size_t k = 0; k < lines.size(); ++k) {
      std::complex<double> sum = 0;
      for (std::size_t i = 0; i < n; ++i)
        sum += x[i] * std::polar(1.0, -2 * M_PI * double(k * i) / double(n));
      EXPECT_LT(std::abs(lines[k] - sum), 1e-13) << n << ' ' << k;
    }
  }
}

TEST(LaggedProducts, ByHand) {
  const std::vector<double> r = lagged_products({1, 2, 3}, 2);
  ASSERT_EQ(r.size(), 3u);
  EXPECT_NEAR(r[0], 14, 1e-13);
  EXPECT_NEAR(r[1], 8, 1e-13);
  EXPECT_NEAR(r[2], 3, 1e-13);
  EXPECT_THROW(lagged_products({1, 2, 3}, 3), InvalidParameter);
}

TEST(CorrelationLength, ByHand) {
  EXPECT_EQ(correlation_length({1, 1, 1, 1, -1, -1, -1, -1}), 1 + 2 * 5.0 / 8);  // lag 1 alone: a quarter
  EXPECT_EQ(correlation_length({1, -1, 1, -1, 1, -1, 1, -1}), 1);
  EXPECT_EQ(correlation_length({0, 0, 0}), 1);
}

TEST(CorrelationLength, OfAnAutoregression) {
  // x[k] = f x[k-1] + e: 1 + 2 sum of f^l = (1 + f) / (1 - f) = 9; cut off at 5 % it lacks 2 * 0.05 / (1 -
  // f).
  constexpr double f = 0.8;
  std::vector<double> x = white(100000, 5);
  for (std::size_t k = 1; k < x.size(); ++k) x[k] += f * x[k - 1];
  EXPECT_NEAR(correlation_length(x), (1 + f) / (1 - f) - 0.25, 0.5);
}

TEST(Welch, ASineHasItsPowerAndAGainItsSize) {
  constexpr std::size_t segment = 64;
  constexpr double interval = 1e-3;
  std::vector<double> x(20 * segment), y(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = 3 * std::sin(2 * M_PI * 10 * double(i) / segment);
    y[i] = 2 * 3 * std::sin(2 * M_PI * 10 * double(i) / segment - 0.5);
  }
  const WelchSpectra s = welch(x, y, interval, segment);
  const double power = std::accumulate(s.xx.begin(), s.xx.end(), 0.0) / (segment * interval);
  EXPECT_NEAR(power, 4.5, 1e-10);
  EXPECT_LT(std::abs(s.xy[10] / s.xx[10] - std::polar(2.0, -0.5)), 1e-12);
  EXPECT_NEAR(s.coherence(10), 1, 1e-12);
}

TEST(Welch, WhiteNoiseHasTwiceItsVarianceTimesTheInterval) {
  constexpr std::size_t segment = 64, count = 64000;
  constexpr double interval = 0.5;
  const WelchSpectra s = welch(white(count, 1), white(count, 2), interval, segment);
  const double mean = std::accumulate(s.xx.begin() + 1, s.xx.end(), 0.0) / double(s.xx.size() - 1);
  EXPECT_NEAR(mean, 2 * interval, 5 * 2 * interval * std::sqrt(2.0 / count));  // variance of a variance
  // 1999 segments; the coherence of what has none is 1/n in the mean.
  EXPECT_NEAR(s.averages, 1999 / (1 + 2.0 / 36), 1e-9);
  double coherence = 0;
  for (std::size_t k = 1; k < s.xx.size(); ++k) coherence += s.coherence(k) / double(s.xx.size() - 1);
  EXPECT_NEAR(coherence * s.averages, 1, 5 * std::sqrt(kHannLines / 31));  // exponential, 31 lines
}

TEST(Welch, RefusesWhatItCannotCut) {
  const std::vector<double> x(100, 1.0);
  EXPECT_THROW(welch(x, x, 1, 9), InvalidParameter);
  EXPECT_THROW(welch(x, x, 1, 6), InvalidParameter);
  EXPECT_THROW(welch(x, x, 1, 68), InvalidParameter);
  EXPECT_THROW(welch(x, x, 0, 32), InvalidParameter);
  EXPECT_THROW(welch(x, std::vector<double>(99, 1.0), 1, 32), InvalidParameter);
  EXPECT_EQ(welch(x, x, 1, 32).coherence(3), 0);  // no power
}

}  // namespace
}  // namespace backlash::signal
