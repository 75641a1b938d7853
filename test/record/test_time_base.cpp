// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/record.h"
#include "backlash_diagnosis/record/time_base.h"

namespace backlash::record {
namespace {

// n stamps, 1/1024 s apart: exact in binary, so that an even time base has no rounding.
constexpr double kInterval = 1.0 / 1024;
std::vector<double> even_time(std::size_t n) {
  std::vector<double> time(n);
  for (std::size_t i = 0; i < n; ++i) time[i] = static_cast<double>(i) * kInterval;
  return time;
}

TEST(StampChecker, AcceptsLaterStampsDropsRepeatedOnesAndRefusesEarlierOnes) {
  StampChecker stamps;
  EXPECT_EQ(stamps.next(-5), StampVerdict::accept);
  EXPECT_EQ(stamps.next(-5), StampVerdict::repeated);
  EXPECT_EQ(stamps.next(1), StampVerdict::accept);
  EXPECT_EQ(stamps.next(0.5), StampVerdict::backwards);
  EXPECT_EQ(stamps.last(), 1);
  EXPECT_EQ(stamps.next(0.75), StampVerdict::backwards);  // the refused stamp is not what counts
  EXPECT_EQ(stamps.next(1), StampVerdict::repeated);
  EXPECT_EQ(stamps.next(std::nextafter(1.0, 2.0)), StampVerdict::accept);
  EXPECT_EQ(stamps.accepted(), 3u);
  EXPECT_EQ(stamps.repeated(), 2u);
  EXPECT_EQ(stamps.first_repeated(), -5);
}

// One that jitters goes back by less than an interval, one that comes late by some, and one of another clock
// by more than a gap is long: ten of the shorter of the two intervals before it.
TEST(StampChecker, AStampThatGoesBackByLessThanAGapLosesItsSample) {
  StampChecker stamps;
  for (const double stamp : {0.0, 1.0, 2.0}) EXPECT_EQ(stamps.next(stamp), StampVerdict::accept);
  EXPECT_EQ(stamps.next(1.9), StampVerdict::repeated);
  EXPECT_EQ(stamps.next(1), StampVerdict::repeated);
  EXPECT_EQ(stamps.next(-8), StampVerdict::backwards);
  EXPECT_EQ(stamps.next(3), StampVerdict::accept);
  EXPECT_EQ(stamps.next(100), StampVerdict::accept);
  EXPECT_EQ(stamps.next(90.5), StampVerdict::repeated);
  EXPECT_EQ(stamps.next(90), StampVerdict::backwards);
  EXPECT_EQ(stamps.repeated(), 3u);
}

// Ten samples make a clock; one that is set anew after fewer is no clock.
TEST(StampChecker, CountsOnFromAClockThatWasSet) {
  StampChecker stamps;
  for (int k = 0; k < 10; ++k) {
    EXPECT_FALSE(stamps.resume(-100)) << k;
    stamps.next(100 + k);
  }
  EXPECT_EQ(stamps.next(3), StampVerdict::backwards);
  EXPECT_TRUE(stamps.resume(3));
  const double there = stamps.last();
  EXPECT_GT(there, 109 + kGapFactor);
  EXPECT_EQ(there, 3 + stamps.offset());
  EXPECT_EQ(stamps.next(3), StampVerdict::repeated);
  EXPECT_EQ(stamps.next(4), StampVerdict::accept);
  EXPECT_EQ(stamps.last(), there + 1);
  EXPECT_FALSE(stamps.resume(-50));
  Record record;
  record.time.resize(stamps.accepted());
  record.time[10] = there;
  stamps.count_into(record);
  ASSERT_EQ(record.clock_steps.size(), 1u);
  EXPECT_EQ(record.clock_steps[0].time, there);
  EXPECT_EQ(record.clock_steps[0].back, 106);
}

TEST(StampChecker, TheFirstStampMayBeZero) {
  StampChecker stamps;
  EXPECT_EQ(stamps.next(0), StampVerdict::accept);
  EXPECT_EQ(stamps.next(0), StampVerdict::repeated);
}

TEST(StampChecker, RefusesStampsThatAreNotFinite) {
  StampChecker stamps;
  EXPECT_THROW(stamps.next(std::nan("")), InvalidParameter);
  EXPECT_THROW(stamps.next(std::numeric_limits<double>::infinity()), InvalidParameter);
  EXPECT_EQ(stamps.accepted(), 0u);
}

TEST(StampChecker, DescribesWhatItDropped) {
  StampChecker stamps;
  stamps.next(0.1);
  EXPECT_EQ(stamps.describe(), "");
  stamps.next(0.1);
  EXPECT_EQ(stamps.describe(), "1 repeated time stamp: the later sample dropped; first at time = 0.1 s");
  stamps.next(0.1);
  EXPECT_EQ(stamps.describe("line 3"),
            "2 repeated time stamps: the later sample dropped; first at line 3, time = 0.1 s");
}

TEST(TimeBase, TimesHaveAtMostNineDecimals) {
  EXPECT_EQ(time_text(0), "0");
  EXPECT_EQ(time_text(-0.0), "0");
  EXPECT_EQ(time_text(-1e-12), "0");
  EXPECT_EQ(time_text(0.1 + 0.2), "0.3");
  EXPECT_EQ(time_text(100), "100");
  EXPECT_EQ(time_text(-2.5), "-2.5");
  EXPECT_EQ(time_text(1e-9), "0.000000001");
  EXPECT_EQ(time_text(1700000000.25), "1700000000.25");
  EXPECT_EQ(time_text(1e308).size(), 309u);
}

TEST(TimeBase, MedianIntervalByHand) {
  EXPECT_EQ(median_interval({}), 0);
  EXPECT_EQ(median_interval({3}), 0);
  EXPECT_EQ(median_interval({3, 5}), 2);
  EXPECT_EQ(median_interval({0, 1, 5}), 2.5);        // intervals 1, 4
  EXPECT_EQ(median_interval({0, 8, 9, 11}), 2);      // 8, 1, 2
  EXPECT_EQ(median_interval({0, 8, 9, 11, 15}), 3);  // 8, 1, 2, 4
}

TEST(TimeBase, AnEvenTimeBaseHasNoWarning) {
  EXPECT_TRUE(describe_time_base(even_time(1000)).empty());
  EXPECT_TRUE(describe_time_base({}).empty());
  EXPECT_TRUE(describe_time_base({1}).empty());
  EXPECT_TRUE(describe_time_base({1, 5}).empty());
}

TEST(TimeBase, GapsAreCountedWithTheLongestAndItsPlaceAndAreNoJitter) {
  std::vector<double> time = even_time(1000);
  for (std::size_t i = 301; i < time.size(); ++i) time[i] += 0.125;
  for (std::size_t i = 701; i < time.size(); ++i) time[i] += 0.5;
  const auto warnings = describe_time_base(time);
  ASSERT_EQ(warnings.size(), 1u);
  // 0.5 + 1/1024 and 700/1024 + 0.125
  EXPECT_EQ(warnings[0],
            "2 time gaps: the longest 0.500977 s after time = 0.80859375 s (median interval 0.000976562 s)");
}

TEST(TimeBase, AGapIsLongerThanTenMedians) {
  const auto with_interval = [](double medians) {
    std::vector<double> time = even_time(1000);
    for (std::size_t i = 501; i < time.size(); ++i) time[i] += (medians - 1) * kInterval;
    return describe_time_base(time);
  };
  const auto at_limit =
      with_interval(10);  // one interval of 10 among 999: standard deviation 9/sqrt(999) = 28 %
  ASSERT_EQ(at_limit.size(), 1u);
  EXPECT_EQ(at_limit[0].rfind("time jitter: standard deviation of the interval 28.5 % of the median", 0), 0u)
      << at_limit[0];
  const auto above = with_interval(11);
  ASSERT_EQ(above.size(), 1u);
  EXPECT_EQ(above[0].rfind("1 time gap: ", 0), 0u) << above[0];
}

// Stamps displaced by +-d in turn: intervals T +- 2d, so the standard deviation of the interval is 2d.
std::vector<double> zigzag_time(double displacement) {
  std::vector<double> time = even_time(1001);
  for (std::size_t i = 0; i < time.size(); ++i) time[i] += (i % 2 == 0 ? -1 : 1) * displacement;
  return time;
}

TEST(TimeBase, JitterAboveFivePercentIsReported) {
  // 1000 intervals, half T + 2d and half T - 2d, median T.
  EXPECT_TRUE(describe_time_base(zigzag_time(0.024 * kInterval)).empty());
  const auto warnings = describe_time_base(zigzag_time(kInterval / 16));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(
      warnings[0].rfind("time jitter: standard deviation of the interval 12.5 % of the median interval "
                        "0.000976562 s, 1000 intervals off by more than 5 %, the largest by 0.00012207 s",
                        0),
      0u)
      << warnings[0];
}

TEST(TimeBase, JitterIsMeasuredAgainstTheMeanInterval) {
  // 60 % of the intervals T, 40 % 1.08 T: standard deviation 0.08 sqrt(0.24) = 3.9 %, though 5.06 % around
  // the median.
  std::vector<double> time = {0};
  for (int i = 0; i < 1000; ++i) time.push_back(time.back() + (i % 5 < 3 ? 1 : 1.08) * kInterval);
  EXPECT_TRUE(describe_time_base(time).empty());
}

}  // namespace
}  // namespace backlash::record
