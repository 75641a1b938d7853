// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/ros/pacer.h"

namespace backlash::ros_bridge {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

TEST(SampleTime, IsExactWhereTheIntervalIsAWholeNumberOfNanoseconds) {
  // Ten million seconds of 1 kHz: whole milliseconds, far beyond the 2^53 ns that a double can count.
  for (const long k : {0L, 1L, 999L, 9'007'199'255L, 9'999'999'999L})
    EXPECT_EQ(sample_time(k, 1000), nanoseconds(k * 1'000'000)) << k;
}

TEST(SampleTime, DoesNotAddUpRounding) {
  // A third of a second is not a whole number of nanoseconds, but every third sample is a whole second.
  EXPECT_EQ(sample_time(1, 3), 333'333'333ns);
  EXPECT_EQ(sample_time(2, 3), 666'666'667ns);
  for (const long s : {1L, 1'000L, 1'000'000'000L})
    EXPECT_EQ(sample_time(3 * s, 3), nanoseconds(s * 1'000'000'000)) << s;
}

TEST(Pacer, SampleIsDueFromItsTimeOn) {
  const Pacer pacer(1000);
  EXPECT_TRUE(pacer.is_due(0, 0ns));
  EXPECT_FALSE(pacer.is_due(570, 570ms - 1ns));  // 0.57 * 1000 is below 570 in double
  EXPECT_TRUE(pacer.is_due(570, 570ms));
  EXPECT_FALSE(pacer.is_due(1, -1s)) << "a clock that went back";
}

TEST(Pacer, LagAndWaitAreTheDistanceToTheDueTime) {
  const Pacer pacer(500);  // sample 10 at 20 ms
  EXPECT_EQ(pacer.wait(10, 15ms), 5ms);
  EXPECT_EQ(pacer.lag(10, 15ms), 0ns);
  EXPECT_EQ(pacer.wait(10, 20ms), 0ns);
  EXPECT_EQ(pacer.lag(10, 150ms), 130ms);
  EXPECT_EQ(pacer.wait(10, 150ms), 0ns);
  EXPECT_EQ(pacer.wait(10, -1s), 1020ms);
}

TEST(Pacer, WithoutPaceEverySampleIsDue) {
  const Pacer pacer(0);
  EXPECT_TRUE(pacer.is_due(1'000'000, 0ns));
  EXPECT_EQ(pacer.wait(1'000'000, 0ns), 0ns);
  EXPECT_EQ(pacer.lag(0, 1h), 0ns);
}

}  // namespace
}  // namespace backlash::ros_bridge
