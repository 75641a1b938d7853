// SPDX-License-Identifier: BSD-3-Clause
// Powers of several numbers at once against those of the library.

#pragma GCC diagnostic ignored "-Wpsabi"  // vectors of numbers that cross no boundary of a library
#include <gtest/gtest.h>

#include <cmath>

#include "../../src/diagnosis/lanes_power.h"

namespace backlash::diagnosis {
namespace {

constexpr int kLanes = 8;
using Lanes = double __attribute__((vector_size(8 * kLanes)));

TEST(LanesPower, PowerIsThatOfTheLibrary) {
  for (const double n : {1.0, 1.1, 1.362, 1.5, 2.0})
    for (double least = 1e-30; least < 1e30; least *= 3.7) {
      Lanes a;
      for (int i = 0; i < kLanes; ++i) a[i] = least * (1 + 0.13 * i);
      const Lanes power = lanes_power(a, n);
      // The header promises 1e-13; pow() itself is right to an ulp.
      for (int i = 0; i < kLanes; ++i)
        EXPECT_NEAR(power[i] / std::pow(a[i], n), 1, 1e-13) << a[i] << " to the power " << n;
    }
}

TEST(LanesPower, NothingHasNoPower) {
  Lanes a{};
  a[3] = 1, a[5] = 4;
  const Lanes power = lanes_power(a, 1.5);
  for (const int i : {0, 1, 2, 4, 6, 7}) EXPECT_EQ(power[i], 0);
  EXPECT_NEAR(power[3], 1, 1e-13);
  EXPECT_NEAR(power[5], 8, 1e-12);
}

// Each with an exponent of its own, below 1 too.
TEST(LanesPower, LogarithmAndExponentialMakeAnyPower) {
  for (double least = 1e-30; least < 1e30; least *= 3.7) {
    Lanes a, y;
    for (int i = 0; i < kLanes; ++i) a[i] = least * (1 + 0.13 * i), y[i] = -0.9 + 0.3 * i;
    const Lanes power = lanes_exp(Lanes(y * lanes_log(a)));
    for (int i = 0; i < kLanes; ++i)
      EXPECT_NEAR(power[i] / std::pow(a[i], y[i]), 1, 1e-13) << a[i] << " to the power " << y[i];
  }
  const Lanes one = lanes_exp(Lanes{});
  for (int i = 0; i < kLanes; ++i) EXPECT_EQ(one[i], 1);
}

}  // namespace
}  // namespace backlash::diagnosis
