// SPDX-License-Identifier: BSD-3-Clause
// Repetition of signals that are made of closed forms and of noise of known size.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/signal/repetition.h"

namespace backlash::signal {
namespace {

std::vector<double> wave(std::size_t n, double period, double second = 0.5) {
  std::vector<double> x(n);
  for (std::size_t k = 0; k < n; ++k)
    x[k] = std::sin(2 * M_PI * double(k) / period) + 0.4 * std::cos(2 * M_PI * double(k) / (second * period));
  return x;
}

TEST(Repetition, FindsThePeriod) {
  for (const std::size_t period : {731u, 6240u}) {
    const auto lag = repetition(wave(20000, double(period)));
    ASSERT_TRUE(lag);
    EXPECT_EQ(*lag % period, 0u) << *lag;
  }
}

TEST(Repetition, NoneWhereNothingComesBack) {
  EXPECT_FALSE(repetition(wave(20000, 9000, std::sqrt(0.5))));  // no common period within it
  EXPECT_FALSE(repetition(std::vector<double>(5000, 1.0)));
  EXPECT_FALSE(repetition(wave(20000, 60000)));
  std::vector<double> ramp(5000);
  for (std::size_t k = 0; k < ramp.size(); ++k) ramp[k] = double(k);
  EXPECT_FALSE(repetition(ramp));
}

// A fast motion on top that does not come back hardly moves the position, but the speed.
TEST(Repetition, TheSpeedMustComeBackToo) {
  std::vector<double> x = wave(20000, 5000);
  for (std::size_t k = 0; k < x.size(); ++k)
    x[k] += 1e-3 * std::sin(0.0397 * double(k) * double(k) / 20000 * 7);
  EXPECT_FALSE(repetition(x));
}

TEST(Repetition, NoiseIsWhatDiffers) {
  Random random(3);
  std::vector<double> x = wave(20000, 4000);
  for (double& value : x) value = 5 * value + 1 + 0.2 * random.normal();
  // 16000 pairs: known to 0.6 %.
  EXPECT_NEAR(repeated_noise(x, std::vector<char>(x.size(), 1), 4000), 0.2, 0.004);
  EXPECT_EQ(repeated_noise(x, std::vector<char>(x.size(), 0), 4000), 0);
}

}  // namespace
}  // namespace backlash::signal
