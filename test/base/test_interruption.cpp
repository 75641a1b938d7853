// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/interruption.h"
#include "backlash_diagnosis/base/parallel.h"

namespace backlash {
namespace {

constexpr int kForever = 1'000'000'000;  // polls: hours, far beyond the limit of the test runner

TEST(InterruptionTest, WithoutOneNothingStops) {
  EXPECT_NO_THROW(stop_if_interrupted());
}

TEST(InterruptionTest, LoopsEndWhereTheCallerNoLongerWantsThem) {
  int asked = 0;
  const Interruption interruption([&] { return ++asked < 3; });
  EXPECT_THROW(for (int i = 0; i < kForever; ++i) stop_if_interrupted(), Cancelled);
  EXPECT_EQ(asked, 3);
  EXPECT_THROW(stop_if_interrupted(), Cancelled);  // it stays so
  EXPECT_EQ(asked, 3);
}

TEST(InterruptionTest, ReachesTheThreadsOfAParallelLoopAndIsNeverAskedByTwo) {
  std::atomic<int> inside{0}, asked{0};
  std::atomic<bool> together{false};
  const Interruption interruption([&] {
    if (++inside > 1) together = true;
    std::this_thread::yield();
    --inside;
    return ++asked < 5;
  });
  EXPECT_THROW(for_each_in_parallel(64,
                                    [](int) {
                                      for (int i = 0; i < kForever; ++i) stop_if_interrupted();
                                    }),
               Cancelled);
  EXPECT_FALSE(together);
  EXPECT_EQ(asked, 5);
}

TEST(InterruptionTest, EndsWithItsScopeAndTheInnermostCounts) {
  const Interruption outer([] { return true; });
  {
    const Interruption inner([] { return false; });
    EXPECT_THROW(stop_if_interrupted(), Cancelled);
  }
  EXPECT_NO_THROW(for (int i = 0; i < 1000; ++i) stop_if_interrupted());
}

}  // namespace
}  // namespace backlash
