// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/ros/held_level.h"

namespace backlash::ros_bridge {
namespace {

TEST(HeldLevelTest, RisesAtOnceAndFallsOnlyAfterTheTimeToTheHighestSince) {
  HeldLevel level(5);
  EXPECT_EQ(level.update(0, 0), 0);
  EXPECT_EQ(level.update(2, 1), 2);
  EXPECT_EQ(level.update(0, 2), 2);
  EXPECT_EQ(level.update(1, 3), 2);
  EXPECT_EQ(level.update(0, 5.9), 2);
  EXPECT_EQ(level.update(0, 6), 1);  // 5 s after the last 2
  EXPECT_EQ(level.update(0, 10.9), 1);
  EXPECT_EQ(level.update(0, 11), 0);
}

TEST(HeldLevelTest, DoesNotFlapAboutALimit) {
  HeldLevel level(5);
  int changes = 0, before = 0;
  for (int i = 0; i < 1000; ++i) {
    const int now = level.update(i % 3 == 0 ? 1 : 0, 0.1 * i);
    changes += now != before;
    before = now;
  }
  EXPECT_EQ(changes, 1);
}

TEST(HeldLevelTest, WithoutTimeItFollows) {
  HeldLevel level(0);
  EXPECT_EQ(level.update(2, 1), 2);
  EXPECT_EQ(level.update(0, 1), 0);
  EXPECT_EQ(level.update(1, 1), 1);
}

}  // namespace
}  // namespace backlash::ros_bridge
