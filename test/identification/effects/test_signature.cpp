// SPDX-License-Identifier: BSD-3-Clause
// When what is left is called noise, and when something is missing: of remainders whose nature is given.
#include <gtest/gtest.h>

#include "identification/effects/signature.h"

namespace backlash::identification {
namespace {

/// Ten times the noise of the sensors, a tenth of the signal.
ChannelRemainder left_of_torque(double explainable, double lower, double unevenness) {
  ChannelRemainder c{"torque", "", {}};
  c.left.rms = 10;
  c.left.floor = 1;
  c.left.signal = 100;
  c.left.explainable = {explainable, lower, explainable + 0.1};
  c.left.follows = {{"motor position", {explainable, lower, explainable}}};
  c.left.unevenness = unevenness;
  return c;
}

TEST(Signature, NamesWhatTheRemainderFollows) {
  const auto u = signature({left_of_torque(0.5, 0.4, 1.2)}, false, {});
  ASSERT_TRUE(u);
  EXPECT_EQ(u->channel, "torque");
  EXPECT_EQ(u->explainable.value, 0.5);
  EXPECT_NE(u->signature.find("motor position (50 % of its variance)"), std::string::npos) << u->signature;
}

TEST(Signature, NoiseOfAnotherColourIsNotMissing) {
  std::vector<ChannelRemainder> all = {left_of_torque(0.02, -0.01, 1.5)};
  all.front().left.signal = 600;
  EXPECT_FALSE(signature(all, false, {}));
  EXPECT_EQ(noise_notes(all, {}).size(), 1u);  // but is reported
}

// A torque from outside, or friction that swings in time, follows no state, and a tenth of the signal is no
// noise of a sensor whose white noise is a hundredth.
TEST(Signature, ButATenthOfTheTorqueIsNoNoise) {
  ChannelRemainder c = left_of_torque(0.02, -0.01, 1.5);
  const auto u = signature({c}, false, {});
  ASSERT_TRUE(u);
  EXPECT_NE(u->signature.find("a torque from outside"), std::string::npos) << u->signature;
  EXPECT_TRUE(noise_notes({c}, {}).empty());
  c.left.floor = 3;
  EXPECT_FALSE(signature({c}, false, {}));
  c.left.signal = 400;
  c.left.floor = 1;  // a fortieth, ten times the noise: may be noise of another colour
  EXPECT_FALSE(signature({c}, false, {}));
  c.left.floor = 0.4;
  EXPECT_TRUE(signature({c}, false, {}));
}

TEST(Signature, WhatDoesNotDifferFromNothingIsNotMissing) {
  ChannelRemainder c = left_of_torque(0.2, -0.05, 1.5);
  c.left.signal = 600;
  EXPECT_FALSE(signature({c}, false, {}));
}

TEST(Signature, WhatComesAndGoesIsNoNoise) {
  const auto u = signature({left_of_torque(0.02, -0.01, 9)}, false, {});
  ASSERT_TRUE(u);
  EXPECT_NE(u->signature.find("comes and goes"), std::string::npos);
}

TEST(Signature, AHundredthOfTheSignalIsWithinWhatAnyModelNeglects) {
  ChannelRemainder c = left_of_torque(0.9, 0.8, 9);
  c.left.signal = 2000;
  EXPECT_FALSE(signature({c}, false, {}));
}

// Sensors that are twenty times finer leave no room for neglect.
TEST(Signature, ButNotWhereItIsFarBeyondTheNoise) {
  ChannelRemainder c = left_of_torque(0.9, 0.8, 1.2);
  c.left.signal = 2000;
  c.left.floor = 0.5;
  EXPECT_TRUE(signature({c}, false, {}));
  c.left.signal = 20000;
  EXPECT_FALSE(signature({c}, false, {}));
}

// How friction begins after each reversal comes and goes, and no model has all of it.
TEST(Signature, WhatComesAndGoesCountsFromAHundredthHoweverFineTheSensors) {
  ChannelRemainder c = left_of_torque(0.02, -0.01, 9);
  c.left.floor = 0.5;
  c.left.signal = 1100;
  EXPECT_FALSE(signature({c}, false, {}));
  c.left.signal = 900;
  EXPECT_TRUE(signature({c}, false, {}));
}

// What the states show of it is less than a hundredth of the signal, but what is left is more and is no
// noise.
TEST(Signature, APartThatShowsSpeaksForAllThatIsLeft) {
  ChannelRemainder c = left_of_torque(0.2, 0.1, 1.2);
  c.left.signal = 600;
  EXPECT_TRUE(signature({c}, false, {}));
  c.left.floor = 9;  // mostly noise, of which nothing can be said
  EXPECT_FALSE(signature({c}, false, {}));
}

// An effect of a hundredth of the signal that leaves half of that: another one stands behind it.
TEST(Signature, BesideASmallEffectLessIsWorthSaying) {
  ChannelRemainder c = left_of_torque(0.5, 0.4, 1.2);
  c.left.signal = 2000;
  EXPECT_FALSE(signature({c}, false, {}));
  c.left.explained = 20;
  EXPECT_TRUE(signature({c}, false, {}));
  c.left.explained = 200;
  EXPECT_FALSE(signature({c}, false, {}));
}

TEST(Signature, TwoEncodersDoNotWander) {
  ChannelRemainder c = left_of_torque(0.02, -0.01, 1.5);
  c.channel = "deflection";
  const auto u = signature({c}, false, {});
  ASSERT_TRUE(u);
  EXPECT_NE(u->signature.find("encoders have no such noise"), std::string::npos) << u->signature;
}

TEST(Signature, TakesTheChannelOfWhichMostIsExplainable) {
  ChannelRemainder deflection = left_of_torque(0.3, 0.2, 1);
  deflection.channel = "deflection";
  const auto u = signature({left_of_torque(0.2, 0.1, 1), deflection}, false, {});
  ASSERT_TRUE(u);
  EXPECT_EQ(u->channel, "deflection");
}

// So few samples that no regression could say what it follows do say that it is three thousand times the
// noise.
TEST(Signature, AShortRecordLeavesTooMuchAsALongOneDoes) {
  ChannelRemainder c = left_of_torque(0, 0, 0);
  c.left.explainable = {}, c.left.follows.clear();
  c.left.rms = 141, c.left.floor = 0.045;
  const auto u = signature({c}, false, {});
  ASSERT_TRUE(u);
  EXPECT_NE(u->signature.find("too short"), std::string::npos) << u->signature;
}

}  // namespace
}  // namespace backlash::identification
