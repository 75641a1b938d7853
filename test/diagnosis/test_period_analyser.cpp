// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/period_analyser.h"

namespace backlash::diagnosis {
namespace {

const ApdLayout kLayout = {10, -1, 1};

std::vector<double> stamps(std::size_t count, double interval, double start = 0) {
  std::vector<double> time;
  for (std::size_t i = 0; i < count; ++i) time.push_back(start + i * interval);
  return time;
}

/// All windows of a run; the value of a sample is its phase in the period, so that windows can be
/// distinguished.
std::vector<PeriodResult> windows_of(const std::vector<double>& time, double period) {
  PeriodAnalyser analyser(period, kLayout);
  std::vector<PeriodResult> windows;
  for (const double t : time)
    if (const PeriodResult* window = analyser.add(t, std::sin(2 * M_PI * (t - time[0]) / period)))
      windows.push_back(*window);
  if (const PeriodResult* window = analyser.finish()) windows.push_back(*window);
  return windows;
}

TEST(PeriodAnalyser, RefusesPeriodsOutsideTheirRange) {
  for (const double period : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(PeriodAnalyser(period, kLayout), InvalidParameter) << period;
}

TEST(PeriodAnalyser, EveryWindowHasItsSamplesAtAnyStart) {
  for (const double start : {0.0, -3.7, 0.05, 1.7e9, 1.7e9 + 0.12345}) {
    const auto windows = windows_of(stamps(1000, 1e-3, start), 0.1);
    ASSERT_EQ(windows.size(), 10u) << start;
    for (std::size_t k = 0; k < windows.size(); ++k) {
      EXPECT_EQ(windows[k].index, static_cast<long>(k));
      EXPECT_EQ(windows[k].signal.count(), 100u) << start << ' ' << k;
      EXPECT_EQ(windows[k].apd.samples(), 100u);
      EXPECT_TRUE(windows[k].complete);
      // At 1.7e9 s a stamp is a multiple of 2.4e-7 s.
      EXPECT_NEAR(windows[k].start, start + 0.1 * k, 5e-7);
      EXPECT_NEAR(windows[k].end, start + 0.1 * (k + 1) - 5e-4, 1e-6);
      EXPECT_NEAR(windows[k].largest_gap, 1e-3, 1e-6);
    }
  }
}

TEST(PeriodAnalyser, ClosesWithTheLastSampleOfAWindow) {
  PeriodAnalyser analyser(0.1, kLayout);
  for (int i = 0; i < 250; ++i) EXPECT_EQ(analyser.add(i * 1e-3, 0) != nullptr, i == 99 || i == 199) << i;
}

TEST(PeriodAnalyser, JitterUnderAQuarterOfASampleChangesNothing) {
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u}) {
    Random random(seed);
    auto time = stamps(5000, 1e-3, 1.7e9);
    for (double& t : time) t += random.uniform(-0.24e-3, 0.24e-3);
    const auto windows = windows_of(time, 0.1);
    ASSERT_EQ(windows.size(), 50u);
    for (const PeriodResult& window : windows) {
      EXPECT_EQ(window.signal.count(), 100u) << window.index;
      EXPECT_TRUE(window.complete);
    }
  }
}

// One sample lost (or two nearly together) among the first must not decide about all windows.
TEST(PeriodAnalyser, AnUnevenStartShiftsNoWindow) {
  for (const int lost : {1, 200}) {  // samples that are missing after the first
    auto time = stamps(1300, 1e-3);
    time.erase(time.begin() + 1, time.begin() + 1 + lost);
    const auto windows = windows_of(time, 0.1);
    ASSERT_GE(windows.size(), 10u) << lost;
    for (const PeriodResult& window : windows) {
      const bool whole = window.index > lost / 100;
      EXPECT_EQ(window.signal.count() == 100, whole) << lost << ' ' << window.index;
      EXPECT_TRUE(window.complete || !whole);
    }
    EXPECT_EQ(windows.back().index, 12);
  }
  auto time = stamps(1000, 1e-3);
  time[1] = 1e-9;
  const auto windows = windows_of(time, 0.1);
  ASSERT_EQ(windows.size(), 10u);
  for (const PeriodResult& window : windows) EXPECT_TRUE(window.complete) << window.index;
}

TEST(PeriodAnalyser, PeriodsThatAreNoMultipleOfTheSamplingInterval) {
  for (const double ratio : {99.5, 100.25, 33.333333333, 16.0 * M_PI, 1024 / 10.0}) {
    const double interval = 1e-3, period = ratio * interval;
    const auto time = stamps(20000, interval, 5);
    const auto windows = windows_of(time, period);
    std::size_t samples = 0;
    for (const PeriodResult& window : windows) {
      EXPECT_EQ(window.index, &window - windows.data());
      EXPECT_TRUE(window.complete);
      EXPECT_GE(window.signal.count() + 1.0, ratio);
      EXPECT_LE(window.signal.count() - 1.0, ratio);
      samples += window.signal.count();
    }
    // Nothing is lost or counted twice: all samples but those of the last, unfinished window.
    EXPECT_EQ(windows.size(), static_cast<std::size_t>(std::floor((time.size() + 0.5) / ratio))) << ratio;
    EXPECT_NEAR(samples, windows.size() * ratio, 1) << ratio;
  }
}

TEST(PeriodAnalyser, AGapSpoilsOnlyItsWindow) {
  auto time = stamps(1000, 1e-3);
  time.erase(time.begin() + 310, time.begin() + 320);  // 11 ms without a sample, in window 3
  time.erase(time.begin() + 590, time.begin() + 600);  // was 600 .. 609: at the start of window 6
  const auto windows = windows_of(time, 0.1);
  ASSERT_EQ(windows.size(), 10u);
  for (const PeriodResult& window : windows) {
    const bool whole = window.index != 3 && window.index != 6;
    EXPECT_EQ(window.complete, whole) << window.index;
    EXPECT_NEAR(window.largest_gap, whole ? 1e-3 : window.index == 3 ? 11e-3 : 10e-3, 1e-9);
  }
}

TEST(PeriodAnalyser, AGapUnderFivePercentIsReportedButAccepted) {
  auto time = stamps(1000, 1e-3);
  time.erase(time.begin() + 310, time.begin() + 313);
  const auto windows = windows_of(time, 0.1);
  EXPECT_TRUE(windows[3].complete);
  EXPECT_NEAR(windows[3].largest_gap, 4e-3, 1e-9);
  EXPECT_EQ(windows[3].signal.count(), 97u);
}

TEST(PeriodAnalyser, AGapOverWholeWindowsSkipsThem) {
  auto time = stamps(1000, 1e-3);
  time.erase(time.begin() + 150, time.begin() + 720);
  const auto windows = windows_of(time, 0.1);
  std::vector<long> indices, complete;
  for (const PeriodResult& window : windows) {
    indices.push_back(window.index);
    if (window.complete) complete.push_back(window.index);
  }
  EXPECT_EQ(indices, (std::vector<long>{0, 1, 7, 8, 9}));
  EXPECT_EQ(complete, (std::vector<long>{0, 8, 9}));
}

TEST(PeriodAnalyser, VeryLongAndVeryShortPeriods) {
  EXPECT_TRUE(windows_of(stamps(2000, 1e-3), 1e9).empty());
  EXPECT_TRUE(
      windows_of(stamps(2000, 1e-3), 1e-300).empty());  // shorter than the sampling interval: no windows
  const auto windows = windows_of(stamps(2000, 1), 1000);
  ASSERT_EQ(windows.size(), 2u);
  EXPECT_EQ(windows[1].signal.count(), 1000u);
}

TEST(PeriodAnalyser, FinishAcceptsAWindowThatLacksAFractionOfASample) {
  const double period =
      99.75e-3;  // the second window ends 1.0 intervals after sample 198, 1.5 samples after it began
  PeriodAnalyser analyser(period, kLayout);
  int returned = 0;
  for (int i = 0; i < 199; ++i) returned += analyser.add(i * 1e-3, 0) != nullptr;
  EXPECT_EQ(returned, 1);
  const PeriodResult* last = analyser.finish();
  ASSERT_NE(last, nullptr);
  EXPECT_EQ(last->index, 1);
  EXPECT_EQ(analyser.finish(), nullptr);
  PeriodAnalyser cut(period, kLayout);
  for (int i = 0; i < 190; ++i) cut.add(i * 1e-3, 0);
  EXPECT_EQ(cut.finish(), nullptr);
}

TEST(PeriodAnalyser, ResetStartsOver) {
  PeriodAnalyser analyser(0.1, kLayout);
  for (int i = 0; i < 130; ++i) analyser.add(i * 1e-3, 0);
  analyser.reset();
  for (int i = 0; i < 99; ++i) EXPECT_EQ(analyser.add(-50 + i * 1e-3, 1), nullptr);
  const PeriodResult* window = analyser.add(-50 + 0.099, 1);
  ASSERT_NE(window, nullptr);
  EXPECT_EQ(window->index, 0);
  EXPECT_EQ(window->signal.count(), 100u);
  EXPECT_EQ(window->signal.mean(), 1);
}

TEST(PeriodAnalyser, AgreesWithASeparateDistributionOfEachWindow) {
  PeriodAnalyser analyser(0.05, kLayout);
  Random random(3);
  AmplitudeDistribution expected(kLayout);
  for (int i = 0; i < 500; ++i) {
    const double value = random.uniform(-1.1, 1.1);
    expected.add(value);
    const PeriodResult* window = analyser.add(2 + i * 1e-3, value);
    if (i % 50 != 49) continue;
    ASSERT_NE(window, nullptr) << i;
    EXPECT_EQ(window->apd.counts(), expected.counts());
    EXPECT_EQ(window->apd.above(), expected.above());
    expected.clear();
  }
}

TEST(WindowGrid, IndexAndStartAgreeAtTheBorders) {
  for (const double origin : {0.0, 1.7e9, -0.05})
    for (const double period : {0.1, 1.0 / 3, 0.0995}) {
      const WindowGrid grid{origin, period, 1e-3};
      for (const long k : {0L, 1L, 7L, 1000L, 123457L}) {
        const double border = grid.start(k);
        EXPECT_EQ(grid.index(border), k);
        EXPECT_EQ(grid.index(std::nextafter(border, -1e300)), k - 1);
        EXPECT_EQ(grid.completed(border), grid.index(border + 1e-3));
      }
      EXPECT_EQ(grid.completed(origin - 10), 0);
    }
}

TEST(WindowGrid, NeedsItsLeadingSamples) {
  EXPECT_FALSE(window_grid(stamps(kLeadingSamples - 1, 1e-3), 0.1));
  const auto grid = window_grid(stamps(kLeadingSamples, 1e-3, 4), 0.1);
  ASSERT_TRUE(grid);
  EXPECT_NEAR(grid->interval, 1e-3, 1e-15);
  EXPECT_NEAR(grid->origin, 4 - 0.5e-3, 1e-14);
}

}  // namespace
}  // namespace backlash::diagnosis
