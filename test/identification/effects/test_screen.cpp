// SPDX-License-Identifier: BSD-3-Clause
// Which candidates the search sees and fits, on torques that are written down.
#include <gtest/gtest.h>

#include <cmath>

#include "identification/effects/orthogonal_part.h"
#include "identification/effects/steps.h"
#include "identification/effects/trial.h"
#include "support/one_inertia_bench.h"

namespace backlash::identification {
namespace {

using test::cogging_torque;
using test::OneInertiaMachine;
using test::SearchBench;

OneInertiaMachine with_cogging() {
  OneInertiaMachine machine;
  machine.extra = cogging_torque(0.8, 7, 0.6);
  return machine;
}

TEST(OrthogonalPart, IsWhatTheColumnsCannotMake) {
  MachineFit fit;
  fit.fit.jacobian.resize(4, 2);
  fit.fit.jacobian << 1e3, 0, 1e3, 0, 0, 2e-3, 0, 0;
  fit.fit.residuals = Eigen::Vector4d(1, 3, 5, 7);
  const OrthogonalPart part(fit, 4);
  EXPECT_LT((part.residuals() - Eigen::Vector4d(-1, 1, 0, 7)).norm(), 1e-12);
  EXPECT_LT(part.of(Eigen::Vector4d(2, 2, 9, 0)).norm(), 1e-12);
  EXPECT_LT((part.of(Eigen::Vector4d(0, 0, 0, 4)) - Eigen::Vector4d(0, 0, 0, 4)).norm(), 1e-12);
}

TEST(Screen, PutsTheAddedEffectFirst) {
  const SearchBench bench{with_cogging()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const std::vector<Candidate> all =
      screen(h.fitted->fit, h.fitted->records, bench.context.range, bench.context.settings.screen);
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all[0].id, "cogging");
  EXPECT_NEAR(all[0].terms[0].at("order"), 7, 0.3);  // an eighth of the resolution of 2.2
  EXPECT_NEAR(std::fabs(all[0].terms[0].at("amplitude")), 0.8, 0.05);
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_LE(all[i].gain, all[i - 1].gain);
}

TEST(Trial, IsTheFitOfMachineAndEffectTogether) {
  const SearchBench bench{with_cogging()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const auto trial = tried(h, test::cogging_effect(0.5, 7, 0.3).candidate, bench.context);
  ASSERT_TRUE(trial);
  EXPECT_NEAR(trial->candidate.terms[0].at("amplitude"), 0.8, 0.02);
  EXPECT_NEAR(trial->candidate.terms[0].at("phase"), 0.6, 0.03);
  EXPECT_NEAR(trial->fit.machine.rig.motor.inertia, 2, 0.03);
  EXPECT_LT(trial->residual, 0.5 * h.fitted->fit.fit.residuals.norm());
}

// The error of a frequency over an even record, sqrt(24 / N) / T noise / amplitude (Rife and Boorstyn 1974,
// IEEE Trans. Inf. Theory 20:591): 0.05 / 0.8 sqrt(24 / 2000) / 2.8 = 0.0024 for the order; the sweep is not
// even, a few times that.
TEST(Screen, FindsAnOrderThatIsNoWholeNumberInTheSpectrum) {
  OneInertiaMachine machine;
  machine.extra = cogging_torque(0.8, 18.667, 0.6);
  const SearchBench bench{machine};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  const std::vector<Candidate> all =
      screen(h.fitted->fit, h.fitted->records, bench.context.range, bench.context.settings.screen);
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all[0].id, "cogging");
  EXPECT_NEAR(all[0].terms[0].at("order"), 18.667, 0.56);  // a quarter of the resolution, where a fit arrives
  const auto trial = tried(h, all[0], bench.context);
  ASSERT_TRUE(trial);
  EXPECT_NEAR(trial->candidate.terms[0].at("order"), 18.667, 0.012);
}

// 1.5 periods in the travel: a whole number is tried first, and left where another number is clearly better.
TEST(Trial, OfALowOrderIsFreeOnlyWhereThatIsClearlyBetter) {
  for (const double order : {3.0, 3.45}) {
    OneInertiaMachine machine;
    machine.extra = cogging_torque(0.8, order, 0.6);
    const SearchBench bench{machine};
    const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
    Candidate whole = test::cogging_effect(0.5, 3, 0.3).candidate;
    whole.held_orders = {0.5};
    const auto held = tried(h, whole, bench.context);
    ASSERT_TRUE(held);
    EXPECT_EQ(held->candidate.terms[0].at("order"), 3);
    const Trial free = with_free_orders(h, *held, bench.context);
    if (order == 3)
      EXPECT_EQ(free.candidate.terms[0].at("order"), 3);
    else
      EXPECT_NEAR(free.candidate.terms[0].at("order"), 3.45, 0.05);
    EXPECT_EQ(free.candidate.held_orders.empty(), order != 3);
  }
}

// The screen may be misled by what is missing: the next whole numbers are reached by way of those between.
TEST(Trial, AWrongWholeOrderBecomesTheRightOne) {
  OneInertiaMachine machine;
  machine.extra = cogging_torque(0.8, 3, 0.6);
  const SearchBench bench{machine};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  Candidate whole = test::cogging_effect(0.5, 4, 0.3).candidate;
  whole.held_orders = {0.5};
  const auto wrong = tried(h, whole, bench.context);
  ASSERT_TRUE(wrong);
  const Trial right = with_free_orders(h, *wrong, bench.context);
  EXPECT_EQ(right.candidate.terms[0].at("order"), 3);
  EXPECT_EQ(right.candidate.held_orders.at(0), 0.5);
}

TEST(Trial, WhatIsPredictedToGainLittleIsNotFitted) {
  const SearchBench bench{with_cogging()};
  const Hypothesis h = fit_declared(test::one_inertia_rig(), bench.context);
  Candidate good = test::cogging_effect(0.8, 7, 0.6).candidate, poor = test::drag_effect(0.1).candidate;
  good.gain = 0.8;
  poor.gain = 0.1;  // below a fifth of the best
  const Trials trials = tried_best(h, {good, poor}, bench.context);
  ASSERT_EQ(trials.fitted.size(), 1u);
  EXPECT_EQ(trials.fitted[0].candidate.id, "cogging");
  ASSERT_EQ(trials.rejected.size(), 1u);
  EXPECT_EQ(trials.rejected[0].id, "quadratic_drag");
  EXPECT_NE(trials.rejected[0].reason.find("10 %"), std::string::npos) << trials.rejected[0].reason;
}

}  // namespace
}  // namespace backlash::identification
