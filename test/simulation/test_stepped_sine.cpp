// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/excitation.h"

namespace backlash::simulation {
namespace {

TEST(SteppedSine, EveryFrequencyHasItsWholeCyclesAndThenItStartsAgain) {
  const auto sine = stepped_sine_excitation(2, 0.5, 2, 0.5, 3, 10);
  const std::vector<double> ends = {6, 9, 11, 12.5};  // 3 / 0.5, + 3 / 1, + 3 / 1.5, + 3 / 2
  EXPECT_DOUBLE_EQ(sine->period(), 12.5);
  for (long k = 0; k < 12; ++k) {
    const long turns = k / 4;
    const double turn = 12.5 * static_cast<double>(turns);
    EXPECT_NEAR(sine->segment_end(k), turn + ends[k % 4], 1e-13) << k;
    const double start = turn + (k % 4 == 0 ? 0 : ends[k % 4 - 1]), frequency = 0.5 * (k % 4 + 1);
    for (double cycles = 0; cycles <= 3; cycles += 0.1)  // the argument has an error of some 1e-13
      EXPECT_NEAR(sine->torque(start + cycles / frequency, k), 10 + 2 * std::sin(2 * M_PI * cycles), 1e-11);
  }
}

TEST(SteppedSine, TorqueIsContinuousAtEverySwitch) {
  const auto sine = stepped_sine_excitation(300, 0.25, 100, 0.25, 10, -7);
  for (long k = 0; k < 1000; ++k) {
    const double end = sine->segment_end(k);  // up to 800 s: rounding of 1e-13 s, times 2 pi 100 Hz 300 N m
    EXPECT_NEAR(sine->torque(end, k), -7, 1e-7) << k;
    EXPECT_NEAR(sine->torque(end, k + 1), -7, 1e-7) << k;
  }
}

// 10 cycles at 0.25 Hz to 100 Hz in steps of 0.25 Hz: 10 / 0.25 times the harmonic number of 400.
TEST(SteppedSine, TheSweepOfTheThesisLastsAHarmonicSum) {
  const double euler = 0.57721566490153286, n = 400;
  const double harmonic = std::log(n) + euler + 1 / (2 * n) - 1 / (12 * n * n);  // next term below 1e-12
  EXPECT_NEAR(stepped_sine_excitation(1, 0.25, 100, 0.25, 10)->period(), 40 * harmonic, 1e-9);
}

TEST(SteppedSine, StepsThatDoNotMeetTheEndStopBeforeIt) {
  EXPECT_NEAR(stepped_sine_excitation(1, 1, 2.2, 0.5, 1)->period(), 1 + 1 / 1.5 + 0.5, 1e-15);
  EXPECT_NEAR(stepped_sine_excitation(1, 0.1, 0.3, 0.1, 1)->period(), 10 + 5 + 10 / 3.0, 1e-13);  // decimals
  EXPECT_EQ(stepped_sine_excitation(1, 4, 4, 1, 8)->period(), 2);
}

TEST(SteppedSine, RefusesWhatHasNoMeaning) {
  EXPECT_THROW(stepped_sine_excitation(std::nan(""), 1, 2, 1, 1), InvalidParameter);
  EXPECT_THROW(stepped_sine_excitation(1, 0, 2, 1, 1), InvalidParameter);
  EXPECT_THROW(stepped_sine_excitation(1, 3, 2, 1, 1), InvalidParameter);
  EXPECT_THROW(stepped_sine_excitation(1, 1, 2, 0, 1), InvalidParameter);
  EXPECT_THROW(stepped_sine_excitation(1, 1, 2, 1e-6, 1), InvalidParameter);
  EXPECT_THROW(stepped_sine_excitation(1, 1, 2, 1, 0), InvalidParameter);
}

}  // namespace
}  // namespace backlash::simulation
