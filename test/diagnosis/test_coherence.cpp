// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/coherence.h"

namespace backlash::diagnosis {
namespace {

std::vector<double> white(std::size_t count, unsigned seed) {
  Random random(seed);
  std::vector<double> x(count);
  for (double& v : x) v = random.normal();
  return x;
}

double mean(const std::vector<double>& x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

constexpr std::size_t kSegment = 128, kCount = 40000;

/// Mean coherence of white x and y(x, independent white noise).
double mean_coherence(const std::function<double(double, double)>& y) {
  const std::vector<double> x = white(kCount, 1), noise = white(kCount, 2);
  std::vector<double> out(kCount);
  for (std::size_t i = 0; i < kCount; ++i) out[i] = y(x[i], noise[i]);
  return mean(estimate_coherence(x, out, 1000, kSegment).coherence);
}

TEST(Coherence, OfALinearSystemWithNoiseIsSignalOverAll) {
  for (const double noise : {0.1, 0.5, 1.0, 3.0}) {
    const double expected = 1 / (1 + noise * noise);
    const double n = (2.0 * kCount / kSegment - 1) / (1 + 2.0 / 36);
    const double biased = expected + (1 - expected) * (1 - expected) / n;
    // Five standard errors of a mean over 63 lines, of which neighbours correlate.
    const double error = std::sqrt(2 * expected / n * 1.94 / 63) * (1 - expected);
    EXPECT_NEAR(mean_coherence([noise](double x, double e) { return 3 * x + 3 * noise * e; }), biased,
                5 * error);
  }
}

TEST(Coherence, OfACubicOfGaussianNoise) {
  // Bussgang: the best line through y = x^3 has slope 3 for unit variance, E[x^6] = 15, so gamma^2 = 9 / 15.
  // x + a x^3: slope 1 + 3 a, power 1 + 6 a + 15 a^2. Tolerance: 3 % for sixth moments of 40000 samples.
  EXPECT_NEAR(mean_coherence([](double x, double) { return x * x * x; }), 0.6, 0.018);
  const double a = 0.2;
  EXPECT_NEAR(mean_coherence([a](double x, double) { return x + a * x * x * x; }),
              std::pow(1 + 3 * a, 2) / (1 + 6 * a + 15 * a * a), 0.01);
  EXPECT_LT(mean_coherence([](double x, double) { return x * x; }), 0.01);  // even: no linear part at all
}

TEST(Coherence, BiasAndSignificanceWhereThereIsNone) {
  double bias = 0, beyond = 0, lines = 0, n = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto s = estimate_coherence(white(1280, 100 + seed), white(1280, 200 + seed), 1, 128);
    n = s.averages;
    for (const double c : s.coherence) {
      bias += c;
      beyond += c > s.significance;
      ++lines;
    }
  }
  EXPECT_NEAR(n, 19 / (1 + 2.0 / 36), 1e-12);
  // 1260 lines of standard deviation 1/n, neighbours correlate: five standard errors 0.2/n; the n of
  // overlapping segments is an approximation good to 10 %.
  EXPECT_NEAR(bias / lines, 1 / n, 0.3 / n);
  EXPECT_NEAR(beyond / lines, 0.05, 0.03);
}

TEST(Coherence, LinesPowerAndLimits) {
  const std::vector<double> x = white(kCount, 4);
  const auto s = estimate_coherence(x, x, 1000, kSegment);
  ASSERT_EQ(s.frequency.size(), kSegment / 2 - 1);
  EXPECT_DOUBLE_EQ(s.frequency.front(), 1000.0 / kSegment);
  for (const double c : s.coherence) EXPECT_NEAR(c, 1, 1e-12);
  EXPECT_NEAR(mean(s.input_power) * 500, 1,
              0.05);  // variance 1 over 500 Hz; five standard errors of a variance
  EXPECT_EQ(mean(estimate_coherence(x, std::vector<double>(kCount, 2.0), 1000, kSegment).coherence), 0);
  EXPECT_THROW(estimate_coherence(x, white(10, 1), 1, 8), InvalidParameter);
  EXPECT_THROW(estimate_coherence(x, x, 1, 7), InvalidParameter);
  EXPECT_THROW(estimate_coherence(x, x, 1, 2 * kCount), InvalidParameter);
}

/// Torque white up to half of the sampling rate, and a response.
record::Record record_of(const std::function<double(double, double)>& response,
                         std::vector<double> torque = white(20000, 9)) {
  record::Record r;
  const std::vector<double> noise = white(torque.size(), 8);
  for (std::size_t i = 0; i < torque.size(); ++i) {
    r.time.push_back(1e-3 * static_cast<double>(i));
    r.column(record::Channel::sensor_torque).push_back(response(torque[i], noise[i]));
  }
  r.column(record::Channel::motor_torque) = std::move(torque);
  return r;
}

CoherenceSettings settings() {
  CoherenceSettings s;
  s.response = record::Channel::sensor_torque;
  s.segment = 0.128;
  return s;
}

double slightly_noisy(double x, double e) {
  return 2 * x + 0.2 * e;
}

TEST(CoherenceDetector, FindsANonlinearityAgainstTheHealthyMachine) {
  CoherenceSettings s = settings();
  const CoherenceDetection healthy = detect_nonlinearity(record_of(slightly_noisy), s);
  ASSERT_EQ(healthy.status, Status::ok) << healthy.message;
  EXPECT_FALSE(healthy.nonlinear);
  EXPECT_NEAR(healthy.loss, 1 - 1 / 1.01, 5 * healthy.deviation);
  s.baseline = CoherenceBaseline{healthy.loss, healthy.deviation, healthy.lower, healthy.upper};
  const CoherenceDetection same = detect_nonlinearity(record_of(slightly_noisy, white(20000, 77)), s);
  ASSERT_EQ(same.status, Status::ok) << same.message;
  EXPECT_FALSE(*same.nonlinear);
  const auto dead_zone = [](double x, double e) {
    return slightly_noisy(std::copysign(std::max(0.0, std::abs(x) - 0.8), x), e);
  };
  const CoherenceDetection worn = detect_nonlinearity(record_of(dead_zone), s);
  ASSERT_EQ(worn.status, Status::ok) << worn.message;
  EXPECT_TRUE(*worn.nonlinear);
  EXPECT_GT(worn.index_lower, s.least_growth);
  s.least_growth = worn.index;
  const CoherenceDetection open = detect_nonlinearity(record_of(dead_zone), s);
  EXPECT_EQ(open.status, Status::ambiguous);
  EXPECT_FALSE(open.nonlinear);
}

// Theory: a factor changes no coherence, so the motor's current or voltage alone says what its torque says.
TEST(CoherenceDetector, TheMotorsCurrentServesAsWell) {
  record::Record current = record_of(slightly_noisy);
  const CoherenceDetection torque = detect_nonlinearity(current, settings());
  for (const double value : current.column(record::Channel::motor_torque))
    current.column(record::Channel::motor_current).push_back(-value / 0.03);
  current.column(record::Channel::motor_torque).clear();
  const CoherenceDetection found = detect_nonlinearity(current, settings());
  ASSERT_EQ(found.status, Status::ok) << found.message;
  EXPECT_NEAR(found.loss, torque.loss, 1e-12);
}

TEST(CoherenceDetector, RefusesTorqueThatIsNotRandomAndBroad) {
  const auto status = [](const std::function<double(double)>& torque) {
    std::vector<double> t;
    for (int i = 0; i < 20000; ++i) t.push_back(torque(1e-3 * i));
    return detect_nonlinearity(record_of(slightly_noisy, t), settings()).status;
  };
  EXPECT_EQ(status([](double t) { return std::fmod(10 * t, 1) < 0.5 ? 1.0 : -1.0; }), Status::out_of_domain);
  EXPECT_EQ(status([](double t) { return std::sin(60 * t); }), Status::out_of_domain);
  EXPECT_EQ(status([](double t) {
              return std::sin(60 * t) + std::sin(77.7 * t) + std::sin(91.3 * t) + std::sin(99 * t);
            }),
            Status::out_of_domain);
  EXPECT_EQ(status([](double) { return 1.0; }), Status::out_of_domain);
  // Random, but again and again.
  const std::vector<double> once = white(2000, 3);
  const std::size_t count = once.size();
  const auto repeated = [&](double t) {
    return once[static_cast<std::size_t>(std::lround(1000 * t)) % count];
  };
  EXPECT_EQ(status(repeated), Status::out_of_domain);
}

TEST(CoherenceDetector, WhatTheRecordLacks) {
  CoherenceSettings s = settings();
  record::Record r = record_of(slightly_noisy);
  EXPECT_EQ(detect_nonlinearity(r.slice(0, 1), s).status, Status::insufficient_data);
  s.response = record::Channel::load_velocity;
  EXPECT_EQ(detect_nonlinearity(r, s).status, Status::insufficient_data);
  s.response = record::Channel::sensor_torque;
  r.time.back() += 1;
  EXPECT_EQ(detect_nonlinearity(r, s).status, Status::out_of_domain);
  const auto refused = [](void (*spoil)(CoherenceSettings&)) {
    CoherenceSettings bad = settings();
    spoil(bad);
    EXPECT_THROW(detect_nonlinearity(record::Record(), bad), InvalidParameter);
  };
  refused([](auto& c) { c.segment = 0; });
  refused([](auto& c) { c.lower = -1; });
  refused([](auto& c) { c.lower = 5, c.upper = 4; });
  refused([](auto& c) { c.least_growth = 0; });
  refused([](auto& c) { c.baseline = CoherenceBaseline{2, 0, kNaN, kNaN}; });
  refused([](auto& c) { c.baseline = CoherenceBaseline{0.1, -1, kNaN, kNaN}; });
}

}  // namespace
}  // namespace backlash::diagnosis
