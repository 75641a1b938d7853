// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/signal_checks.h"
#include "support/waves.h"

namespace backlash::diagnosis {
namespace {

using test::kWaves;
using test::sample;
using test::Signal;

double period_of(const Signal& signal) {
  return detect_period(signal.time, signal.value).value_or(0);
}

TEST(DetectPeriod, EveryWaveExactly) {
  for (const auto& [name, wave] : kWaves)
    for (const double periods : {2.0, 2.5, 3.0, 7.3, 40.0})
      EXPECT_NEAR(period_of(sample(wave, periods, 100)), 1, 1e-9)
          << name << ' ' << periods;  // a whole number of samples
}

TEST(DetectPeriod, NotFromLessThanTwoPeriods) {
  for (const auto& [name, wave] : kWaves)
    for (const double periods : {0.3, 1.0, 1.5, 1.9}) {
      // Shorter repetitions inside the waves may be found; the period itself must not be made up.
      const double found = period_of(sample(wave, periods, 100));
      EXPECT_LT(found, 0.55) << name << ' ' << periods;
    }
  for (const char* name : {"sine", "square", "triangle"})
    for (const auto& [other, wave] : kWaves)
      EXPECT_TRUE(other != name || period_of(sample(wave, 1.5, 100)) == 0) << name;
}

TEST(DetectPeriod, NoiseAndJitter) {
  for (const auto& [name, wave] : kWaves)
    for (const double jitter : {0.0, 0.2})
      for (const double noise : {0.02, 0.1})
        // 2 %: what the comparison with a curve's frequency allows; the top of a sine's correlation is flat.
        EXPECT_NEAR(period_of(sample(wave, 12, 100, noise, jitter)), 1, 0.02)
            << name << ' ' << noise << ' ' << jitter;
}

TEST(DetectPeriod, EpochStampsAndGaps) {
  for (const auto& [name, wave] : kWaves) {
    // A stamp at 1.7e9 s is a multiple of 2.4e-7 s.
    EXPECT_NEAR(period_of(sample(wave, 10, 1000, 0, 0, 1.7e9)), 1, 1e-3) << name;
    Signal gap = sample(wave, 20, 100);
    gap.time.erase(gap.time.begin() + 730, gap.time.begin() + 790);
    gap.value.erase(gap.value.begin() + 730, gap.value.begin() + 790);
    EXPECT_NEAR(period_of(gap), 1, 0.01) << name;
  }
}

TEST(DetectPeriod, PeriodsThatAreNoMultipleOfTheInterval) {
  for (const double per_period : {33.3, 99.5, 102.4})
    for (const auto& [name, wave] : kWaves)
      EXPECT_NEAR(period_of(sample(wave, 15, per_period)), 1, 1.01 / per_period) << name;  // one sample
}

TEST(DetectPeriod, LongRecordsKeepTheirResolution) {
  for (const auto& [name, wave] : kWaves) EXPECT_NEAR(period_of(sample(wave, 6000, 100)), 1, 0.01) << name;
}

TEST(DetectPeriod, VeryLongPeriods) {
  for (const double periods : {2.0, 3.4}) {
    // Known to one step of n/65536 samples.
    EXPECT_NEAR(period_of(sample(kWaves[1].second, periods, 300000)), 1, 1e-4);
    EXPECT_NEAR(period_of(sample(kWaves[0].second, periods, 300000)), 1,
                1e-2);  // flat top of the sine's correlation
  }
}

TEST(DetectPeriod, ExcitationThatBeginsLate) {
  Signal signal = sample(kWaves[1].second, 3000, 100, 0.01);
  Random random(6);
  for (int i = 0; i < 200000; ++i) signal.value[i] = 0.01 * random.normal();
  EXPECT_NEAR(period_of(signal), 1, 1e-9);
}

TEST(DetectPeriod, NothingWhereNothingRepeats) {
  const auto none = [](const std::vector<double>& value) {
    std::vector<double> time;
    for (std::size_t i = 0; i < value.size(); ++i) time.push_back(1e-3 * i);
    return !detect_period(time, value);
  };
  EXPECT_TRUE(none({}));
  EXPECT_TRUE(none({1, -1, 1, -1}));
  EXPECT_TRUE(none(std::vector<double>(1000, 0)));
  EXPECT_TRUE(none(std::vector<double>(1000, 0.1 + 0.2)));
  Random random(5);
  std::vector<double> white(3000), ring(3000), ramp(3000);
  for (int i = 0; i < 3000; ++i) {
    white[i] = random.normal();
    ring[i] = std::exp(-i / 300.0) * std::cos(2 * M_PI * i / 40.0);
    ramp[i] = i;
  }
  EXPECT_TRUE(none(white));
  EXPECT_TRUE(none(ring));  // one impact is no excitation
  EXPECT_TRUE(none(ramp));
  Signal bad = sample(kWaves[0].second, 10, 100);
  for (const double value : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    bad.value[123] = value;
    EXPECT_EQ(period_of(bad), 0) << value;
  }
  EXPECT_FALSE(detect_period({0, 1, 2, 3, 4, 5, 6, 7, 8}, {1, 2}));  // lengths differ
}

TEST(MedianMagnitude, OddEvenNegativeAndNaN) {
  EXPECT_EQ(signal_level({}), 0);
  EXPECT_EQ(signal_level({std::nan("")}), 0);
  EXPECT_EQ(signal_level({-3, 1, 2}), 2);
  EXPECT_EQ(signal_level({-5, std::nan(""), 1, -5, 1e9, std::nan(""), -5}), 5);
}

std::vector<double> clipped(std::vector<double> signal, double low, double high) {
  for (double& v : signal) v = std::max(low, std::min(high, v));
  return signal;
}

std::vector<double> rounded(std::vector<double> signal, double step) {
  for (double& v : signal) v = std::round(v / step) * step;
  return signal;
}

TEST(LooksSaturated, ClippedSignals) {
  for (const double noise : {0.0, 0.01}) {
    const auto sine = sample(kWaves[0].second, 20, 100, noise).value,
               ringing = sample(kWaves[6].second, 20, 400, noise).value;
    EXPECT_FALSE(looks_saturated(sine)) << noise;
    EXPECT_FALSE(looks_saturated(ringing)) << noise;
    EXPECT_TRUE(looks_saturated(clipped(sine, -0.9, 0.9))) << noise;
    EXPECT_TRUE(looks_saturated(clipped(sine, -9, 0.9))) << noise;
    EXPECT_TRUE(looks_saturated(clipped(sine, -0.9, 9))) << noise;
    EXPECT_TRUE(looks_saturated(clipped(ringing, -2, 2))) << noise;
    EXPECT_TRUE(looks_saturated(rounded(clipped(ringing, -2, 2), 0.01))) << noise;
  }
}

TEST(LooksSaturated, RestIsNoSaturation) {
  EXPECT_FALSE(looks_saturated({}));
  EXPECT_FALSE(looks_saturated({1, 1, 1}));
  EXPECT_FALSE(looks_saturated(std::vector<double>(100, 3.0)));
  EXPECT_FALSE(looks_saturated(sample(kWaves[1].second, 20, 100).value));  // a clean square wave
  // A sensor with coarse steps comes to rest at the level of the excitation.
  std::vector<double> settling;
  for (int i = 0; i < 4000; ++i)
    settling.push_back((i / 100 % 2 ? -1 : 1) * (1 - 2 * std::exp(-(i % 100) / 8.0)));
  EXPECT_FALSE(looks_saturated(rounded(settling, 0.02)));
  EXPECT_FALSE(looks_saturated(rounded(sample(kWaves[0].second, 20, 100).value, 0.01)));
}

}  // namespace
}  // namespace backlash::diagnosis
