// SPDX-License-Identifier: BSD-3-Clause
// What runs for months beside a robot asks nothing of the heap, sample by sample and period by period.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/diagnosis/period_analyser.h"
#include "backlash_diagnosis/diagnosis/sample_stream.h"
#include "support/allocations.h"

namespace backlash::diagnosis {
namespace {

constexpr double kRate = 1000, kPeriod = 0.1;
const ApdLayout kLayout{60, -0.4, 0.4};

double signal(long k) {
  return 0.3 * std::sin(2 * M_PI * double(k) / (kRate * kPeriod)) + 0.05 * std::sin(1.7 * double(k));
}

TEST(SteadyState, TheCountIsReal) {
  test::AllocationCount count;
  double* volatile place = new double(1);  // volatile: a pair that nobody sees may be left out
  delete place;
  EXPECT_EQ(count.stop(), 1);
}

TEST(SteadyState, PeriodsAreAnalysedWithoutTheHeap) {
  PeriodAnalyser analyser(kPeriod, kLayout);
  long k = 0, periods = 0;
  double skewness = 0;
  const auto run = [&](double seconds) {
    for (const long end = k + std::lround(seconds * kRate); k < end; ++k)
      if (const PeriodResult* period = analyser.add(double(k) / kRate, signal(k))) {
        ++periods;
        skewness += period->apd.skewness();
      }
  };
  run(1);
  test::AllocationCount count;
  run(10);
  EXPECT_EQ(count.stop(), 0);
  EXPECT_EQ(periods, 110);
  EXPECT_TRUE(std::isfinite(skewness));
}

TEST(SteadyState, SamplesAreKeptAndForgottenWithoutTheHeap) {
  StreamSettings settings;
  settings.keep = 2;
  settings.apd.emplace();
  settings.apd->period = kPeriod;
  settings.apd->layout = kLayout;
  SampleStream stream(settings);
  record::ChannelValues values;
  values.fill(std::nan(""));
  long k = 0, periods = 0;
  const auto run = [&](double seconds) {
    for (const long end = k + std::lround(seconds * kRate); k < end; ++k) {
      values[std::size_t(record::Channel::sensor_torque)] = signal(k);
      values[std::size_t(record::Channel::motor_torque)] =
          values[std::size_t(record::Channel::motor_position)] = 0.1 * signal(k);
      periods += stream.add(double(k) / kRate, values) != nullptr;
    }
  };
  run(4);  // it has forgotten once by then
  test::AllocationCount count;
  run(20);
  EXPECT_EQ(count.stop(), 0);
  EXPECT_EQ(periods, 240);
  EXPECT_GE(stream.periods(), 19);
}

}  // namespace
}  // namespace backlash::diagnosis
