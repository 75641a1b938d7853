// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/procedures/frequency_response.h"
#include "backlash_diagnosis/identification/procedures/stepped_sine.h"
#include "support/two_mass_record.h"

namespace backlash::identification {
namespace {

using test::kConfiguration2;
using test::SteppedSine;
using Complex = std::complex<double>;

/// Cramer's rule on the two equations of motion: an oracle apart from the code's impedances.
Complex exact(const test::TwoMassMachine& m, double frequency) {
  const Complex s(0, 2 * M_PI * frequency), shaft = m.damping * s + m.stiffness;
  const Complex a = m.motor_inertia * s * s + m.motor_viscous * s + shaft,
                d = m.load_inertia * s * s + m.load_viscous * s + shaft;
  return s * d / (a * d - shaft * shaft);
}

Complex error(const ResponsePoint& p) {
  return p.response / exact(kConfiguration2, p.frequency) - 1.0;
}

double worst(const FrequencyResponse& response, double from, double to) {
  double w = 0;
  for (const ResponsePoint& p : response.points)
    if (p.frequency >= from && p.frequency <= to) w = std::max(w, std::abs(error(p)));
  return w;
}

/// Root mean square of the error in stated standard errors, real and imaginary part.
double pull(const FrequencyResponse& response, double from, double to) {
  double errors = 0, stated = 0;
  for (const ResponsePoint& p : response.points) {
    if (p.frequency < from || p.frequency > to) continue;
    errors += std::norm(error(p)) / std::norm(p.standard_error);
    stated += 2;
  }
  return std::sqrt(errors / stated);
}

const record::Record& sweep() {
  static const record::Record record =
      test::two_mass_record(kConfiguration2, SteppedSine().torque(), SteppedSine().duration());
  return record;
}

ResponseSettings held() {
  ResponseSettings settings;
  settings.held = true;
  return settings;
}

record::Record held_noise_record(double duration, unsigned seed, double deviation = 300) {
  return test::two_mass_record(kConfiguration2,
                               test::held_noise(deviation, std::lround(1000 * duration), seed), duration);
}

TEST(SteppedSineResponse, OfSinesThatEndBetweenSamples) {
  // 97.3 Hz at 1 kHz: 10.28 samples a cycle. A pure sine is in the span of the fit: rounding only, 1e-6 for
  // the frequency that passages give.
  for (const double f : {0.31, 7.7, 97.3, 203.0}) {
    std::vector<double> u, y;
    const auto n = static_cast<std::size_t>(12000 / f);
    for (std::size_t k = 0; k < n; ++k) {
      const double angle = 2 * M_PI * f * double(k) / 1000;
      u.push_back(5 + 3 * std::sin(angle));
      y.push_back(1 + 1e-5 * double(k) + 0.6 * std::sin(angle - 1.2));
    }
    const SineRuns found = find_sine_runs(u);
    ASSERT_EQ(found.runs.size(), 1u) << f;
    const ResponsePoint point = sine_response(u, y, found.runs[0]);
    EXPECT_NEAR(1000 * point.frequency, f, 1e-3 * f);
    // A frequency off by 1e-3 turns both alike; what remains is of second order.
    EXPECT_NEAR(std::abs(point.response), 0.2, 2e-4) << f;
    EXPECT_NEAR(std::arg(point.response), -1.2, 1e-3) << f;
    EXPECT_FALSE(point.reverses);
    EXPECT_GT(point.coherence, 0.9999);
  }
}

TEST(SteppedSineResponse, OfTheSweepOfTheThesis) {
  const FrequencyResponse response = estimate_response(sweep());
  // 400 frequencies; near 0.25 % steps a run may hold a neighbour's cycle or split once.
  EXPECT_NEAR(double(response.points.size()), 400, 20);
  EXPECT_NEAR(response.points.front().frequency, 0.25, 1e-3);
  EXPECT_NEAR(response.points.back().frequency, 100, 0.1);
  // Transients of ten cycles: e^(-2 cycles) of a step of 1 % in frequency.
  EXPECT_LT(worst(response, 0.5, 100), 3e-3);
  EXPECT_EQ(response.variance_factor, 1);
}

TEST(SteppedSineResponse, StandardErrorsHoldTheNoise) {
  // Torque noise of 0.5 N m moves the passages too, which is part of the error.
  double square = 0;
  constexpr unsigned kSeeds = 3;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const FrequencyResponse response = estimate_response(test::with_noise(sweep(), seed));
    ASSERT_GT(response.points.size(), 380u);
    square += std::pow(pull(response, 0.5, 100), 2) / kSeeds;
    EXPECT_LT(worst(response, 20, 60), 0.02) << seed;
  }
  // Seven cycles give the error to 1/sqrt(12), so the square of the pull is on average 12/10; 1200 points of
  // that: 3 %. The few runs over a step are far off and add most of the tolerance.
  EXPECT_NEAR(std::sqrt(square), std::sqrt(1.2), 0.25);
}

TEST(SteppedSineResponse, ReversalIsMarkedAndABiasAvoidsIt) {
  test::TwoMassMachine rubbing = kConfiguration2;
  rubbing.motor_coulomb = 60;
  SteppedSine sines;
  sines.first = 1, sines.last = 5, sines.amplitude = 120;
  const record::Record reversing = test::two_mass_record(rubbing, sines.torque(), sines.duration());
  sines.bias = 90;  // 30 N m against 21 N m s/rad: 1.4 rad/s, the sine moves 0.17 rad/s at 1 Hz
  const record::Record biased = test::two_mass_record(rubbing, sines.torque(), sines.duration());
  for (const ResponsePoint& p : estimate_response(reversing).points) {
    EXPECT_TRUE(p.reverses);
    EXPECT_GT(std::abs(error(p)), 0.1) << p.frequency;  // Coulomb friction is half of the torque
  }
  const FrequencyResponse response = estimate_response(biased);
  ASSERT_GE(response.points.size(), 17u);
  for (const ResponsePoint& p : response.points) {
    // The bias sets in as a step: the speed reverses only while it still rises (time constant 5 s).
    EXPECT_TRUE(!p.reverses || p.frequency < 1.1) << p.frequency;
  }
  EXPECT_LT(worst(response, 1.2, 5), 5e-3);
}

TEST(SteppedSineResponse, OtherTorquesAreNoSines) {
  std::vector<double> square, random(20000, 0.0), chirp;
  test::add_noise(random, 1, 3);
  for (int k = 0; k < 20000; ++k) {
    square.push_back(k % 100 < 50 ? 1 : -1);
    chirp.push_back(std::sin(2 * M_PI * (0.5e-3 * k + 0.5 * 5e-6 * k * k)));  // to 100 Hz in 20 s
  }
  EXPECT_EQ(find_sine_runs(square).share, 0);
  EXPECT_LT(find_sine_runs(random).share, 0.1);
  EXPECT_LT(find_sine_runs(chirp).share, 0.7);
}

TEST(BroadbandResponse, OfHeldNoiseWithAndWithoutItsHold) {
  const record::Record record = test::with_noise(held_noise_record(120, 5, 30), 7);
  const FrequencyResponse response = estimate_response(record, held());
  ASSERT_GT(response.points.size(), 1000u);
  // Windows smear what is narrow (anti-resonance) and what drifts, so only away from them. 1500 lines of
  // which two share noise: 2 % of the pull, leakage lifts it.
  EXPECT_NEAR(pull(response, 60, 200), 1, 0.15);
  EXPECT_LT(worst(response, 15, 100), 0.1);
  EXPECT_GT(response.variance_factor, 1.5);
  // Without: late by half a sample, 0.31 rad at 100 Hz.
  for (const ResponsePoint& p : estimate_response(record).points)
    if (std::fabs(p.frequency - 100) < 0.1) {
      EXPECT_NEAR(std::arg(p.response / exact(kConfiguration2, p.frequency)), -0.314, 0.01);
    }
}

TEST(BroadbandResponse, OfThePositionIsThatOfTheSpeed) {
  record::Record record = held_noise_record(60, 6);
  const FrequencyResponse speed = estimate_response(record, held());
  record.column(record::Channel::motor_velocity).clear();
  const FrequencyResponse position = estimate_response(record, held());
  double difference = 0;
  ASSERT_EQ(speed.points.size(), position.points.size());
  for (std::size_t i = 0; i < speed.points.size(); ++i)
    if (speed.points[i].frequency > 5)
      difference =
          std::max(difference, std::abs(position.points[i].response / speed.points[i].response - 1.0));
  // At 250 Hz the central difference alone loses 36 %, the images of the hold add 11 % to the speed.
  EXPECT_LT(difference, 0.02);
}

TEST(BroadbandResponse, OfASquareWaveAtItsOddHarmonics) {
  const double f = 1.37;
  const auto torque = [f](double t, long) { return std::sin(2 * M_PI * f * t) >= 0 ? 60.0 : -60.0; };
  const FrequencyResponse response = estimate_response(test::two_mass_record(kConfiguration2, torque, 120));
  ASSERT_GT(response.points.size(), 8u);
  for (const ResponsePoint& p : response.points) {
    if (p.frequency > 12) break;
    const double order = p.frequency / f;
    EXPECT_NEAR(order, 2 * std::round((order - 1) / 2) + 1, 0.005);  // a line is 0.09 wide
    // The switches fall between samples: 1 ms of 730 ms is 0.3 % of the power on the fundamental.
    EXPECT_LT(std::abs(error(p)), 0.05) << p.frequency;
  }
}

TEST(BroadbandResponse, OfAChirp) {
  const auto torque = [](double t, long) {
    const double in = std::fmod(t, 20);
    return 60 * std::sin(2 * M_PI * (0.5 * in + 0.5 * 4 * in * in));  // 0.5 to 80.5 Hz in 20 s
  };
  const FrequencyResponse response = estimate_response(test::two_mass_record(kConfiguration2, torque, 120));
  EXPECT_GT(response.variance_factor, 1.5);
  EXPECT_LT(worst(response, 15, 75), 0.05);  // windows of 8 s: 0.18 Hz on a resonance 9 Hz wide
}

TEST(Response, SaysWhatIsMissing) {
  const record::Record good = held_noise_record(5, 1);
  const auto expect = [](const record::Record& record, const std::string& part,
                         ResponseSettings settings = {}) {
    try {
      estimate_response(record, settings);
      ADD_FAILURE() << part;
    } catch (const CannotIdentify& e) {
      EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
    }
  };
  EXPECT_NO_THROW(estimate_response(good));
  record::Record bad = good;
  bad.column(record::Channel::motor_torque).clear();
  expect(bad, "no motor_torque");
  bad = good;
  bad.column(record::Channel::motor_torque).assign(bad.size(), 7);
  expect(bad, "does not vary");
  bad = good;
  bad.column(record::Channel::motor_velocity)[99] = NAN;
  expect(bad, "motor_velocity has values that are not finite");
  bad = good;
  bad.column(record::Channel::motor_velocity).clear();
  bad.column(record::Channel::motor_position).clear();
  expect(bad, "neither motor_velocity nor motor_position");
  bad = good;
  bad.column(record::Channel::motor_velocity).assign(bad.size(), 0);
  test::add_noise(bad.column(record::Channel::motor_velocity), 1, 77);
  // Of 14 averages one line in 300 reaches 0.35 by chance, none 0.9.
  ResponseSettings strict;
  strict.least_coherence = 0.9;
  expect(bad, "highest coherence", strict);
  expect(good.slice(0, 0.2), "do not hold");
  ResponseSettings wrong;
  wrong.least_coherence = 1.5;
  EXPECT_THROW(estimate_response(good, wrong), InvalidParameter);
}

}  // namespace
}  // namespace backlash::identification
