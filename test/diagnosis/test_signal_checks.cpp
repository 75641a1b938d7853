#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/signal_checks.h"

namespace backlash {
namespace {

using Wave = std::function<double(double phase)>;  // phase in periods

const std::vector<std::pair<std::string, Wave>> kWaves = {
    {"sine", [](double p) { return std::sin(2 * M_PI * p); }},
    {"square", [](double p) { return p - std::floor(p) < 0.5 ? 1.0 : -1.0; }},
    {"triangle", [](double p) { return 4 * std::fabs(p - std::floor(p) - 0.5) - 1; }},
    {"sawtooth", [](double p) { return 2 * (p - std::floor(p)) - 1; }},
    {"pulses", [](double p) { return p - std::floor(p) < 0.1 ? 1.0 : 0.0; }},
    // Lines at 2, 3 and 5 times the common frequency: repeats once per period, and nearly so earlier.
    {"multi-sine",
     [](double p) { return std::sin(4 * M_PI * p) + std::sin(6 * M_PI * p + 1) + 0.5 * std::sin(10 * M_PI * p); }},
    // A square wave whose steps ring ten times faster.
    {"ringing",
     [](double p) {
       const double half = 2 * (p - std::floor(p)), s = half < 1 ? half : half - 1, sign = half < 1 ? 1 : -1;
       return sign * (1 - 2 * std::exp(-4 * s) * std::cos(20 * M_PI * s));
     }},
};

struct Signal {
  std::vector<double> time, value;
};

/// `noise`: standard deviation; `jitter`: of the stamps, in samples.
Signal sample(const Wave& wave, double periods, double per_period, double noise = 0, double jitter = 0, double start = 0) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Signal signal;
  const auto count = static_cast<int>(std::lround(periods * per_period));
  for (int i = 0; i < count; ++i) {
    const double t = (i + std::max(-0.45, std::min(0.45, jitter * normal(random)))) / per_period;
    signal.time.push_back(start + t);
    signal.value.push_back(wave(t + 0.3 / per_period) + noise * normal(random));
  }
  return signal;
}

double period_of(const Signal& signal) { return detect_period(signal.time, signal.value).value_or(0); }

TEST(DetectPeriod, EveryWaveExactly) {
  for (const auto& [name, wave] : kWaves)
    for (const double periods : {2.0, 2.5, 3.0, 7.3, 40.0})
      EXPECT_NEAR(period_of(sample(wave, periods, 100)), 1, 1e-9) << name << ' ' << periods;  // a whole number of samples
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
      if (other == name) EXPECT_EQ(period_of(sample(wave, 1.5, 100)), 0) << name;
}

TEST(DetectPeriod, NoiseAndJitter) {
  for (const auto& [name, wave] : kWaves)
    for (const double jitter : {0.0, 0.2})
      for (const double noise : {0.02, 0.1})
        // 2 %: what the comparison with a curve's frequency allows; the top of a sine's correlation is flat.
        EXPECT_NEAR(period_of(sample(wave, 12, 100, noise, jitter)), 1, 0.02) << name << ' ' << noise << ' ' << jitter;
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
    EXPECT_NEAR(period_of(sample(kWaves[0].second, periods, 300000)), 1, 1e-2);  // flat top of the sine's correlation
  }
}

TEST(DetectPeriod, ExcitationThatBeginsLate) {
  Signal signal = sample(kWaves[1].second, 3000, 100, 0.01);
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200000; ++i) signal.value[i] = 0.01 * normal(random);
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
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<double> white(3000), ring(3000), ramp(3000);
  for (int i = 0; i < 3000; ++i) {
    white[i] = normal(random);
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
  EXPECT_EQ(median_magnitude({}), 0);
  EXPECT_EQ(median_magnitude({std::nan("")}), 0);
  EXPECT_EQ(median_magnitude({-3, 1, 2}), 2);
  EXPECT_EQ(median_magnitude({-5, std::nan(""), 1, -5, 1e9, std::nan(""), -5}), 5);
}

/// Five standard errors (relative) of the noise estimate from `blocks` stretches. The 20 % quantile of n values with
/// density f there scatters by sqrt(0.2 0.8 / n) / f; chi-square with 10 degrees has f(6.179) = 0.0864; neighbouring
/// periods share samples, which raises the variance by at most 1.5; the root halves it.
double five_errors(double blocks) { return 5 * std::sqrt(1.5 * 0.16 / blocks) / 0.0864 / 6.179 / 2; }

TEST(EstimateNoise, KnownWhiteNoiseOnAnyWave) {
  for (const auto& [name, wave] : kWaves)
    for (const double noise : {1e-3, 0.03, 0.5}) {
      const Signal signal = sample(wave, 60, 200, noise);
      const auto found = estimate_noise(signal.value, 200);
      ASSERT_TRUE(found);
      EXPECT_NEAR(*found / noise, 1, five_errors(59 * 20)) << name << ' ' << noise;
    }
}

TEST(EstimateNoise, OfAFewPeriods) {
  const Signal signal = sample(kWaves[0].second, 2, 500, 0.1);
  EXPECT_NEAR(*estimate_noise(signal.value, 500) / 0.1, 1, five_errors(50));
}

TEST(EstimateNoise, NoiselessAndPartlyChaotic) {
  EXPECT_LT(*estimate_noise(sample(kWaves[6].second, 20, 200).value, 200), 1e-12);
  // Ringing of random size over three quarters of each period: the calmest fifth of all is four fifths of the calm
  // quarter, so the estimate is too high by the root of the 80 % (13.442) over the 20 % quantile (6.179).
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<double> signal;
  double size = 0;
  for (int i = 0; i < 20000; ++i) {
    if (i % 200 == 0) size = normal(random);
    signal.push_back((i % 200 < 150 ? size * std::sin(0.4 * i) : 0) + 0.01 * normal(random));
  }
  EXPECT_NEAR(*estimate_noise(signal, 200) / 0.01, std::sqrt(13.442 / 6.179), 0.1);  // five errors, about 500 stretches
}

// Ringing that never repeats, everywhere: its differences are no white noise, and must not be taken for it.
TEST(EstimateNoise, ChaoticRingingIsNoNoise) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (const double noise : {0.0, 0.01}) {
    std::vector<double> signal;
    double size = 0, phase = 0;
    for (int i = 0; i < 20000; ++i) {
      if (i % 100 == 0) size = 1 + 0.3 * normal(random), phase = normal(random);
      signal.push_back(size * std::sin(0.4 * i + phase) + noise * normal(random));
    }
    // 2: the stretches in which the ringing changes are few but not none.
    EXPECT_LT(*estimate_noise(signal, 200), 2 * std::max(noise, 0.005)) << noise;
    EXPECT_GE(*estimate_noise(signal, 200), 0.9 * noise);
  }
}

TEST(EstimateNoise, NothingWithoutTwoPeriods) {
  const Signal signal = sample(kWaves[0].second, 3, 100, 0.1);
  EXPECT_FALSE(estimate_noise({}, 100));
  EXPECT_FALSE(estimate_noise({signal.value.begin(), signal.value.begin() + 199}, 100));
  EXPECT_TRUE(estimate_noise({signal.value.begin(), signal.value.begin() + 200}, 100));
  for (const double per_period : {0.0, 5.0, -100.0, 1e300, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_FALSE(estimate_noise(signal.value, per_period)) << per_period;
}

TEST(EstimateNoise, LeavesOutValuesThatAreNotFinite) {
  Signal signal = sample(kWaves[0].second, 60, 200, 0.1);
  signal.value[500] = std::nan("");
  signal.value[5000] = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(*estimate_noise(signal.value, 200) / 0.1, 1, five_errors(59 * 20));
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
    const auto sine = sample(kWaves[0].second, 20, 100, noise).value, ringing = sample(kWaves[6].second, 20, 400, noise).value;
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
  for (int i = 0; i < 4000; ++i) settling.push_back((i / 100 % 2 ? -1 : 1) * (1 - 2 * std::exp(-(i % 100) / 8.0)));
  EXPECT_FALSE(looks_saturated(rounded(settling, 0.02)));
  EXPECT_FALSE(looks_saturated(rounded(sample(kWaves[0].second, 20, 100).value, 0.01)));
}

}  // namespace
}  // namespace backlash
