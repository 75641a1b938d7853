// SPDX-License-Identifier: BSD-3-Clause
// When an effect is believed: evidence that is put together by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "identification/effects/acceptance.h"
#include "identification/effects/steps.h"
#include "support/one_inertia_bench.h"

namespace backlash::identification {
namespace {

// Squares of four blocks; torque gains, deflection is absent.
HeldOut blocks(const std::vector<double>& torque, double train) {
  HeldOut h;
  h.torque = torque;
  h.deflection.assign(torque.size(), 0);
  h.torque_train = train;
  return h;
}

TEST(Compare, GainsAreDecreasesOfTheNorm) {
  const Gain gain = compare(blocks({4, 4, 4, 4}, 16), blocks({1, 1, 1, 1}, 4));
  EXPECT_FALSE(gain.deflection);
  EXPECT_NEAR(gain.evidence.gain, 0.5, 1e-12);
  EXPECT_NEAR(gain.evidence.gain_held_out, 0.5, 1e-12);
}

TEST(Compare, TheBlockThatGetsWorseByMostIsLeftOut) {
  const Gain gain = compare(blocks({4, 4, 4, 4}, 16), blocks({1, 1, 1, 100}, 4));
  EXPECT_NEAR(gain.evidence.gain_held_out, 0.5, 1e-12);  // 12 to 3
}

TEST(Compare, HeldOutNeverGainsMoreThanTheFit) {
  const Gain gain = compare(blocks({400, 4, 4, 4}, 16), blocks({1, 1, 1, 1}, 9));
  EXPECT_NEAR(gain.evidence.gain, 0.25, 1e-12);
  EXPECT_NEAR(gain.evidence.gain_held_out, 0.25, 1e-12);
}

TEST(Compare, TheChannelIsThatWhichGainsMost) {
  HeldOut before = blocks({4, 4}, 8), after = blocks({4, 4}, 8);
  before.deflection = {9, 9};
  after.deflection = {1, 1};
  before.deflection_train = 18;
  after.deflection_train = 2;
  EXPECT_TRUE(compare(before, after).deflection);
}

class Objection : public testing::Test {
 protected:
  Objection() {
    gain_.evidence = {0.5, 0.5};
    gain_.total = 0.5;
  }
  std::string objection_to(const Gain& gain) const {
    return objection(gain, h_.fitted->fit.machine, h_.fitted->records, bench_.context.settings);
  }
  test::SearchBench bench_{test::OneInertiaMachine()};
  Hypothesis h_ = fit_declared(test::one_inertia_rig(), bench_.context);
  Gain gain_;
};

TEST_F(Objection, NoneAgainstClearEvidence) {
  EXPECT_EQ(objection_to(gain_), "");
}

TEST_F(Objection, NamesWhatIsTooLittle) {
  gain_.evidence.gain_held_out = 0.09;  // a machine with one channel: 10 %
  EXPECT_NE(objection_to(gain_).find("9 %, 10 %"), std::string::npos) << objection_to(gain_);
  gain_.evidence.gain_held_out = 0.11;
  EXPECT_EQ(objection_to(gain_), "");
}

// sure^2 / (2 n) of n rows of a channel, between the least gain and the one that always is enough.
TEST_F(Objection, LeastGainInNoiseFallsWithTheRows) {
  SearchSettings settings = bench_.context.settings;
  const double rows = 0.5 * double(h_.fitted->records.layout().size());
  settings.asked.least_gain = 1;
  settings.acceptance.least_in_noise = 0;
  EXPECT_NEAR(least_gain_in_noise(h_.fitted->records, settings), 5.5 * 5.5 / (2 * rows), 1e-12);
  settings.asked.least_gain = 1e-6;
  EXPECT_EQ(least_gain_in_noise(h_.fitted->records, settings), 1e-6);
}

// What the machine explains has no gain, whoever predicts which block; an effect that is there has.
TEST_F(Objection, HeldOutGainIsThatOfTheFitWhereItIsReal) {
  test::OneInertiaMachine machine;
  machine.extra = test::cogging_torque(0.8, 7, 0.6);
  const test::SearchBench bench{machine};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const Hypothesis with = add_effect(h, bench.context);
  ASSERT_EQ(with.effects.size(), 1u);
  const Evidence& e = with.effects[0].gain.evidence;
  EXPECT_NEAR(e.gain_held_out, e.gain, 0.1);
}

}  // namespace
}  // namespace backlash::identification
