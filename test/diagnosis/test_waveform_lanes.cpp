// SPDX-License-Identifier: BSD-3-Clause
// Powers of several numbers at once against those of the library.

#pragma GCC diagnostic ignored "-Wpsabi"  // vectors of numbers that cross no boundary of a library
#include <gtest/gtest.h>

#include <cmath>

#include "../../src/diagnosis/waveform_lanes.h"

namespace backlash::diagnosis {
namespace {

TEST(WaveformLanes, PowerIsThatOfTheLibrary) {
  for (const double n : {1.0, 1.1, 1.362, 1.5, 2.0})
    for (double least = 1e-30; least < 1e30; least *= 3.7) {
      WaveformLanes a;
      for (int i = 0; i < kWaveformSets; ++i) a[i] = least * (1 + 0.13 * i);
      const WaveformLanes power = lanes_power(a, n);
      // The header promises 1e-13; pow() itself is right to an ulp.
      for (int i = 0; i < kWaveformSets; ++i)
        EXPECT_NEAR(power[i] / std::pow(a[i], n), 1, 1e-13) << a[i] << " to the power " << n;
    }
}

TEST(WaveformLanes, NothingHasNoPower) {
  WaveformLanes a{};
  a[3] = 1, a[5] = 4;
  const WaveformLanes power = lanes_power(a, 1.5);
  for (const int i : {0, 1, 2, 4, 6, 7}) EXPECT_EQ(power[i], 0);
  EXPECT_NEAR(power[3], 1, 1e-13);
  EXPECT_NEAR(power[5], 8, 1e-12);
}

}  // namespace
}  // namespace backlash::diagnosis
