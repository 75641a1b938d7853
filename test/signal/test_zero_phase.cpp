// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/resampling.h"
#include "backlash_diagnosis/signal/zero_phase.h"

namespace backlash::signal {
namespace {

constexpr double kInterval = 1e-3;  // s

std::vector<double> sine(double frequency, std::size_t n = 4000) {
  std::vector<double> x(n);
  for (std::size_t k = 0; k < n; ++k) x[k] = std::sin(2 * M_PI * frequency * k * kInterval + 0.4);
  return x;
}

/// Largest difference in the middle half, where the ends do not reach.
double difference(const std::vector<double>& a, const std::vector<double>& b, double factor) {
  double worst = 0;
  for (std::size_t k = a.size() / 4; k < 3 * a.size() / 4; ++k)
    worst = std::max(worst, std::fabs(a[k] - factor * b[k]));
  return worst;
}

TEST(ZeroPhase, LowPassHasTheGainOfItsFormulaAndNoPhase) {
  const double cutoff = 60;
  for (const double f : {1.0, 20.0, 60.0, 120.0}) {
    const std::vector<double> x = sine(f);
    const double ratio = std::tan(M_PI * f * kInterval) / std::tan(M_PI * cutoff * kInterval);
    // The filter is exact; 1e-9 is what is left of its start a thousand samples away.
    EXPECT_LT(difference(low_pass(x, kInterval, cutoff), x, 1 / (1 + std::pow(ratio, 8))), 1e-9)
        << f << " Hz";
  }
}

TEST(ZeroPhase, LowPassKeepsConstantsAndRampsToTheEnds) {
  std::vector<double> ramp(500);
  for (std::size_t k = 0; k < ramp.size(); ++k) ramp[k] = 3 - 0.02 * k;
  const std::vector<double> y = low_pass(ramp, kInterval, 30);
  // The point reflection continues a ramp as a ramp; the filter starts as if its first value had stood
  // forever, which decays within the padding to exp(-2 pi 30 Hz 0.064 s cos(3/8 pi)) = 1 % of a padding's
  // rise of 1.3 at its weakest pole.
  for (std::size_t k = 0; k < ramp.size(); ++k) ASSERT_NEAR(y[k], ramp[k], 0.013) << k;
  for (std::size_t k = 100; k < 400; ++k) ASSERT_NEAR(y[k], ramp[k], 1e-5) << k;
}

// Eleven: eight that go together and three that are left. Rounding of values of 1.
TEST(ZeroPhase, ColumnsAreFilteredAsEachByItself) {
  Eigen::MatrixXd columns(700, 11);
  for (int c = 0; c < 11; ++c) {
    const std::vector<double> x = sine(3 + 7 * c, 700);
    columns.col(c) = Eigen::Map<const Eigen::VectorXd>(x.data(), 700);
  }
  low_pass_columns(columns, kInterval, 40);
  for (int c = 0; c < 11; ++c) {
    const std::vector<double> alone = low_pass(sine(3 + 7 * c, 700), kInterval, 40);
    for (int k = 0; k < 700; ++k) ASSERT_NEAR(columns(k, c), alone[std::size_t(k)], 1e-13) << c << ", " << k;
  }
}

TEST(ZeroPhase, DerivativeOfAParabolaIsExactAlsoAtItsEnds) {
  std::vector<double> x(20), rate(20);
  for (int k = 0; k < 20; ++k)
    x[k] = 2 + 3 * k * kInterval + 5 * std::pow(k * kInterval, 2), rate[k] = 3 + 10 * k * kInterval;
  const std::vector<double> y = derivative(x, kInterval);
  for (int k = 0; k < 20; ++k) EXPECT_NEAR(y[k], rate[k], 1e-11);  // rounding of 2 over 1e-3 s
}

TEST(ZeroPhase, DelayShiftsASineByItsPhase) {
  const double f = 20;
  const std::vector<double> x = sine(f);
  for (const double samples : {0.5, 0.25, -1.3, 2.0}) {
    std::vector<double> late(x.size());
    for (std::size_t k = 0; k < x.size(); ++k)
      late[k] = std::sin(2 * M_PI * f * (k - samples) * kInterval + 0.4);
    // Cubic through four points: error at most 0.02 (w T)^3 with w T = 0.126.
    EXPECT_LT(difference(delayed(x, samples), late, 1), 5e-5) << samples;
  }
}

TEST(ZeroPhase, EvenRecordsStayAndJitterIsMended) {
  record::Record record;
  for (int k = 0; k < 200; ++k) {
    record.time.push_back(k * kInterval + (k % 2 ? 2e-4 : 0));
    record.column(record::Channel::motor_position).push_back(7 * record.time.back() - 1);
  }
  const record::Record even = record::evenly_sampled(record);
  for (std::size_t k = 0; k < even.size(); ++k)  // a straight line is interpolated exactly
    ASSERT_NEAR(even.column(record::Channel::motor_position)[k], 7 * even.time[k] - 1, 1e-12);
  for (std::size_t k = 1; k < even.size(); ++k)
    ASSERT_NEAR(even.time[k] - even.time[k - 1], even.sampling_interval(), 1e-12);
  EXPECT_EQ(record::evenly_sampled(even).time, even.time);
  record.time.back() += 1;
  EXPECT_THROW(record::evenly_sampled(record), BadData);
}

TEST(ZeroPhase, RefusesWhatHasNoMeaning) {
  EXPECT_THROW(low_pass({1, 2, 3}, 0, 10), InvalidParameter);
  EXPECT_THROW(low_pass({1, 2, 3}, kInterval, 500), InvalidParameter);
  EXPECT_THROW(derivative({1, 2}, kInterval), InvalidParameter);
}

}  // namespace
}  // namespace backlash::signal
