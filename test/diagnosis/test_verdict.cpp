// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/verdict.h"

namespace backlash::diagnosis {
namespace {

constexpr double kToAngle = 50;  // rad/m

Estimate ok(const std::string& method, double value, double half) {
  Estimate e;
  e.method = method;
  e.status = Status::ok;
  e.backlash = value;
  e.lower = value - half;
  e.upper = value + half;
  e.backlash_angle = kToAngle * e.backlash;
  e.angle_lower = kToAngle * e.lower;
  e.angle_upper = kToAngle * e.upper;
  return e;
}

Estimate at_least(const std::string& method, double bound) {
  Estimate e;
  e.method = method;
  e.status = Status::above_range;
  e.lower = bound;
  e.angle_lower = kToAngle * bound;
  return e;
}

Estimate angles_only(Estimate e) {
  e.backlash = e.lower = e.upper = kNaN;
  return e;
}

Estimate unable(const std::string& method, Status status, const std::string& reason) {
  Estimate e;
  e.method = method;
  e.status = status;
  e.message = reason;
  return e;
}

const Limits kLimits = {false, 1e-4, 1.5e-4, 2e-4};

Verdict combined(const std::vector<Estimate>& estimates, const std::optional<Limits>& limits = kLimits,
                 const std::optional<Baseline>& baseline = std::nullopt) {
  return combine(estimates, limits, baseline);
}

bool mentions(const Verdict& v, const std::string& words) {
  return v.message.find(words) != std::string::npos;
}

/// Play from wall to wall and free play are two quantities: the smaller one is a part of the other.
TEST(Verdict, FreePlayIsAPartOfThePlayFromWallToWall) {
  Estimate whole = ok("lost_motion", 1.2e-4, 2e-6);
  whole.deflection = kToAngle * 6e-5;
  const Verdict v = combined({whole, ok("momentum_transfer", 7e-5, 2e-6)});
  EXPECT_EQ(v.grade, Grade::watch) << v.message;
  EXPECT_NEAR(v.backlash, 1.2e-4, 1e-12);
  EXPECT_TRUE(v.dissenters.empty());
  EXPECT_TRUE(mentions(v, "free play within it by momentum_transfer 7e-05 m")) << v.message;
  // Free play beyond it is impossible, and so is less than what the deflection leaves, 6e-5 m.
  EXPECT_EQ(combined({whole, ok("momentum_transfer", 4e-5, 2e-6)}).grade, Grade::cannot_tell);
  EXPECT_EQ(combined({whole, ok("momentum_transfer", 1.5e-4, 2e-6)}).grade, Grade::cannot_tell);
}

// 8e-5 +- 2e-6 and 8.5e-5 +- 2e-6 lie 3.5 standard deviations apart, 8.9e-5 six.
TEST(Verdict, IntervalsThatJustMissEachOtherWidenTheAnswer) {
  const Verdict near = combined({ok("a", 8e-5, 2e-6), ok("b", 8.5e-5, 2e-6)});
  EXPECT_EQ(near.agreement, "agree");
  EXPECT_NEAR(near.backlash, 8.25e-5, 1e-12);
  EXPECT_NEAR(near.lower, 7.8e-5, 1e-12);
  EXPECT_NEAR(near.upper, 8.7e-5, 1e-12);
  EXPECT_EQ(combined({ok("a", 8e-5, 2e-6), ok("b", 8.9e-5, 2e-6)}).grade, Grade::cannot_tell);
}

// Reported by who is believed, also where the play is too small to be reported; not by who is contradicted.
// 9e-5 +- 3e-5 over the travel, and 8e-5 +- 2e-6 where another looked.
TEST(Verdict, HoldsWhatOneSawAndOthersDidNotLookFor) {
  Estimate wide = ok("a", 9e-5, 3e-5);
  EXPECT_NEAR(combined({wide, ok("b", 8e-5, 2e-6)}).upper, 8.2e-5, 5e-7);
  wide.must_hold = true;
  const Verdict all = combined({wide, ok("b", 8e-5, 2e-6)});
  EXPECT_NEAR(all.backlash, 8e-5, 5e-7);
  EXPECT_DOUBLE_EQ(all.lower, 6e-5);
  EXPECT_DOUBLE_EQ(all.upper, 1.2e-4);
}

TEST(Verdict, SaysWhatInTheFileIsWrong) {
  const ContradictedValue damping = {"motor damping", "N m s/rad", 0.0048, 0.0029, 2e-5};
  const std::string text =
      "; declared motor damping 0.0048 N m s/rad, this record says 0.0029 +- 2e-05: run identify";
  Estimate fitted = ok("fitted", 8e-5, 1e-6);
  fitted.from_record = fitted.fits_machine = true;
  fitted.declared_wrong = {damping};
  const Verdict v = combined({ok("a", 8.1e-5, 2e-6), fitted});
  ASSERT_EQ(v.declared_wrong.size(), 1u);
  EXPECT_EQ(v.declared_wrong[0].found, 0.0029);
  EXPECT_TRUE(mentions(v, text));
  Estimate none = unable("fitted", Status::below_range, "no play");
  none.declared_wrong = {damping};
  EXPECT_TRUE(mentions(combined({none}), text));
  none.status = Status::out_of_domain;
  EXPECT_TRUE(combined({none}).declared_wrong.empty());
  fitted.fits_machine = fitted.from_record = false;
  Estimate measured = ok("measured", 4e-5, 1e-6);
  measured.from_record = true;
  EXPECT_TRUE(combined({measured, fitted}).declared_wrong.empty());
}

TEST(Verdict, CombinesWhatAgreesSharpestFirst) {
  const Verdict v = combined({ok("wide", 9e-5, 3e-5), unable("off", Status::out_of_domain, "x"),
                              ok("narrow", 8e-5, 1e-6), ok("middle", 8e-5, 1e-5)});
  EXPECT_EQ(v.estimate, 2);
  EXPECT_EQ(v.agreement, "agree");
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_EQ(v.members, (std::vector<int>{2, 3, 0}));
  EXPECT_TRUE(v.dissenters.empty());
  EXPECT_TRUE(mentions(v, "by narrow, middle, wide")) << v.message;
  EXPECT_TRUE(mentions(v, "8.001e-05 m (95 %: 7.889e-05 to 8.113e-05)")) << v.message;
  EXPECT_TRUE(std::isnan(v.growth));
  // By hand: weights 1, 1/100, 1/900 to (9e-5, 8e-5, 8e-5) and to the half widths (1e-6, 1e-5, 3e-5).
  const double weights = 1 + 0.01 + 1 / 900.0, value = (8e-5 * 1.01 + 9e-5 / 900) / weights;
  const double half = (1e-6 + 1e-5 / 100 + 3e-5 / 900) / weights;
  EXPECT_NEAR(v.backlash, value, 1e-18);  // rounding
  EXPECT_NEAR(v.lower, value - half, 1e-18);
  EXPECT_NEAR(v.upper, value + half, 1e-18);
  EXPECT_NEAR(v.backlash_angle, kToAngle * v.backlash, 1e-16);
  EXPECT_NEAR(v.angle_lower, kToAngle * v.lower, 1e-16);
  EXPECT_NEAR(v.angle_upper, kToAngle * v.upper, 1e-16);
}

// Errors of two estimators with standard deviations 1 and 2 um, uncorrelated, and fully correlated: the worst
// case.
TEST(Verdict, TheIntervalHoldsItsPromiseForAnyCorrelation) {
  Random random(7);
  constexpr int kRuns = 20000;
  for (const double correlation : {0.0, 0.7, 1.0}) {
    int hits = 0, agreed = 0;
    double squares = 0;
    for (int i = 0; i < kRuns; ++i) {
      const double common = random.normal(), own = random.normal();
      const double a = 1e-6 * common;
      const double b = 2e-6 * (correlation * common + std::sqrt(1 - correlation * correlation) * own);
      const Verdict v = combined({ok("a", 5e-5 + a, 1.96e-6), ok("b", 5e-5 + b, 3.92e-6)});
      if (v.agreement != "agree") continue;
      ++agreed;
      EXPECT_GE(v.upper - v.lower, 2 * 1.96e-6 * (1 - 1e-9));  // never narrower than the best member
      hits += v.lower <= 5e-5 && 5e-5 <= v.upper;
      squares += std::pow(v.backlash - 5e-5, 2);
    }
    // A binomial share of 20000 scatters by 0.15 %: three of them below 95 %.
    EXPECT_GE(hits, 0.9455 * agreed) << correlation;
    // Uncorrelated: sqrt(0.8^2 + (0.2 * 2)^2) = 0.894 um; 2 % is four standard deviations of that estimate.
    if (correlation == 0) {
      EXPECT_NEAR(std::sqrt(squares / agreed), 0.894e-6, 0.02e-6);
    }
  }
}

TEST(Verdict, AnExactEstimateNeedsNoOther) {
  const Verdict v = combined({ok("a", 5e-5, 1e-5), ok("exact", 5.5e-5, 0), ok("b", 5e-5, 2e-5)});
  EXPECT_EQ(v.backlash, 5.5e-5);
  EXPECT_EQ(v.lower, 5.5e-5);
  EXPECT_EQ(v.members.size(), 3u);
}

TEST(Verdict, AMemberThatKnowsNoLengthSaysNothingOfLengths) {
  const Verdict v = combined({ok("a", 5e-5, 1e-6), angles_only(ok("b", 5.1e-5, 1e-6))});
  EXPECT_EQ(v.agreement, "agree");
  EXPECT_EQ(v.backlash, 5e-5);
  EXPECT_NEAR(v.backlash_angle, kToAngle * 5.05e-5, 1e-16);
  EXPECT_EQ(v.grade, Grade::good);
}

TEST(Verdict, GradesByTheWholeInterval) {
  EXPECT_TRUE(mentions(combined({ok("m", 0.9e-4, 0.05e-4)}), "good: "));
  EXPECT_TRUE(mentions(combined({ok("m", 0.9e-4, 0.2e-4)}), "watch, may be good: "));
  EXPECT_TRUE(mentions(combined({ok("m", 0.9e-4, 0.7e-4)}), "watch, may be good or service: "));
  EXPECT_TRUE(mentions(combined({ok("m", 1.2e-4, 0.25e-4)}), "watch, may be good: "));
  EXPECT_TRUE(mentions(combined({ok("m", 1.6e-4, 0.5e-4)}), "service, may be watch or stop: "));
  EXPECT_TRUE(mentions(combined({ok("m", 3e-4, 0.9e-4)}), "stop: "));
  EXPECT_TRUE(mentions(combined({ok("m", 3e-4, 1.2e-4)}), "stop, may be service: "));
  EXPECT_TRUE(mentions(combined({at_least("m", 1.2e-4)}), "watch, may be stop: "));
  Estimate blind = ok("blind", 5e-5, 1e-6);  // nothing says that it is good
  blind.lower = blind.upper = blind.angle_lower = blind.angle_upper = kNaN;
  EXPECT_TRUE(mentions(combined({blind}), "watch, may be good or stop: "));
}

TEST(Verdict, GradesAtTheLimits) {
  const std::vector<std::pair<double, Grade>> cases = {
      {0, Grade::good},          {0.989e-4, Grade::good}, {0.991e-4, Grade::watch},  // + 1e-6
      {1e-4, Grade::watch},      {1.49e-4, Grade::watch}, {1.5e-4, Grade::service},
      {1.99e-4, Grade::service}, {2e-4, Grade::stop},     {1, Grade::stop}};
  for (const auto& [value, grade] : cases) {
    const Verdict v = combined({ok("m", value, 1e-6)});
    EXPECT_EQ(v.grade, grade) << value;
    EXPECT_EQ(v.agreement, "single");
    EXPECT_EQ(v.message.find(to_string(grade)), 0u) << v.message;
  }
}

TEST(Verdict, WithoutLimitsNothingIsGraded) {
  const Verdict v = combined({ok("m", 1, 0.1)}, std::nullopt);
  EXPECT_EQ(v.grade, Grade::ungraded);
  EXPECT_EQ(v.backlash, 1);
  EXPECT_TRUE(mentions(v, "ungraded (no limits are given): backlash 1 m")) << v.message;
  EXPECT_EQ(combined({at_least("m", 1)}, std::nullopt).grade, Grade::cannot_tell);
}

Estimate of_witness(const std::string& witness, Estimate e) {
  e.witness = witness;
  return e;
}

Estimate measured(Estimate e) {
  e.from_record = true;
  return e;
}

TEST(Verdict, WhatHasFittedTheMachineAnswersAlone) {
  Estimate fitted = measured(ok("fitted", 5e-5, 4e-6));
  fitted.fits_machine = true;
  const Verdict agree = combined({fitted, ok("sharp", 5.3e-5, 1e-6)});
  EXPECT_EQ(agree.agreement, "agree");
  EXPECT_EQ(agree.members, std::vector<int>({0}));
  EXPECT_EQ(agree.backlash, 5e-5);
  EXPECT_EQ(agree.lower, 4.6e-5);
  const Verdict apart = combined({fitted, ok("sharp", 9e-5, 1e-6)});
  EXPECT_EQ(apart.members, std::vector<int>({0}));
  EXPECT_EQ(apart.agreement, "disagree: sharp");
  EXPECT_EQ(apart.backlash, 5e-5);
}

TEST(Verdict, ManyDoNotOutvoteOne) {
  for (const int others : {1, 2, 5}) {
    std::vector<Estimate> all = {ok("right", 5e-5, 1e-6)};
    for (int i = 0; i < others; ++i) all.push_back(of_witness("curve", ok("apd", 1.6e-4, 1e-5)));
    for (const std::optional<Limits>& limits : {std::optional<Limits>(kLimits), std::optional<Limits>()}) {
      const Verdict v = combined(all, limits);
      EXPECT_EQ(v.grade, Grade::cannot_tell);
      EXPECT_EQ(v.estimate, -1);
      EXPECT_TRUE(std::isnan(v.backlash) && std::isnan(v.lower) && std::isnan(v.backlash_angle));
      EXPECT_EQ(v.dissenters.size(), all.size());
      EXPECT_TRUE(mentions(v, "cannot tell; disagree: right 5e-05 m (95 %: 4.9e-05 to 5.1e-05)"))
          << v.message;
      EXPECT_TRUE(mentions(v, "nothing in the record shows which is right")) << v.message;
    }
  }
  const Verdict v = combined({ok("a", 5e-5, 1e-5), ok("b", 7e-5, 1e-5 + 1e-12)});  // the intervals just touch
  EXPECT_EQ(v.agreement, "agree");
}

TEST(Verdict, WhatTheRecordShowsStandsAgainstWhatIsDeclared) {
  const Verdict v =
      combined({of_witness("curve", ok("shape", 1.6e-4, 1e-5)), measured(ok("walls", 5e-5, 1e-6)),
                of_witness("curve", ok("skewness", 1.7e-4, 1e-5)), ok("momentum", 5e-5, 1e-5)});
  EXPECT_EQ(v.backlash, 5e-5);
  EXPECT_EQ(v.members, (std::vector<int>{1}));
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_EQ(v.agreement, "disagree: shape, skewness, momentum");
  EXPECT_TRUE(mentions(v, "service by itself")) << v.message;
  EXPECT_TRUE(mentions(v, "is it this machine's?")) << v.message;
  // Two measurements that contradict each other settle nothing.
  EXPECT_EQ(
      combined({measured(ok("a", 5e-5, 1e-6)), measured(ok("b", 9e-5, 1e-6)), ok("c", 9e-5, 1e-6)}).grade,
      Grade::cannot_tell);
}

// An interval of 10 um, of which 8 um by declared values, leaves 6 um of its own: as sharp as the other.
TEST(Verdict, DeclaredValuesWidenTheIntervalNotTheWeight) {
  Estimate walls = ok("walls", 5e-5, 10e-6);
  walls.declared = kToAngle * 8e-6;
  const Verdict v = combined({walls, ok("b", 5.2e-5, 6e-6)});
  EXPECT_NEAR(v.backlash, 5.1e-5, 1e-15);
  EXPECT_NEAR(v.lower, 5.1e-5 - 8e-6, 1e-15);
}

TEST(Verdict, AWitnessThatContradictsItselfIsNotHeard) {
  const std::vector<Estimate> apd = {of_witness("curve", ok("skewness", 2e-5, 5e-6)),
                                     of_witness("curve", ok("shape", 5e-5, 5e-6))};
  EXPECT_EQ(combined(apd).grade, Grade::cannot_tell);
  const Verdict v = combined({apd[0], apd[1], ok("walls", 5e-5, 1e-6)});
  EXPECT_EQ(v.members, (std::vector<int>{2}));
  EXPECT_EQ(v.dissenters, (std::vector<int>{0, 1}));
  EXPECT_TRUE(mentions(v, "contradicts itself")) << v.message;
}

TEST(Verdict, ALowerBoundAlone) {
  EXPECT_EQ(combined({at_least("m", 2.1e-4)}).grade, Grade::stop);
  EXPECT_EQ(combined({at_least("m", 1.2e-4)}).grade, Grade::watch);
  const Verdict low = combined({at_least("m", 0.5e-4)});  // it may well be more
  EXPECT_EQ(low.grade, Grade::cannot_tell);
  EXPECT_EQ(low.estimate, 0);
  EXPECT_EQ(low.agreement, "single");
  EXPECT_NE(low.message.find("at least 5e-05 m"), std::string::npos) << low.message;
}

TEST(Verdict, ALowerBoundBesideASoundEstimate) {
  Verdict v = combined({at_least("apd", 2e-4), ok("lost", 5e-5, 1e-6)});
  EXPECT_EQ(v.grade, Grade::cannot_tell);
  EXPECT_EQ(v.agreement, "disagree: apd, lost");
  EXPECT_TRUE(mentions(v, "disagree: apd at least 0.0002 m, stop by itself")) << v.message;
  v = combined({at_least("low", 1e-4), at_least("high", 2e-4)});
  EXPECT_EQ(v.estimate, 1);
  EXPECT_EQ(v.lower, 2e-4);
  EXPECT_EQ(v.grade, Grade::stop);
  v = combined({at_least("apd", 2e-4), ok("lost", 2.1e-4, 1e-6)});
  EXPECT_EQ(v.agreement, "agree");
  EXPECT_EQ(v.grade, Grade::stop);
}

TEST(Verdict, NothingSoundIsNoAnswerAndSaysWhy) {
  const Verdict v = combined(
      {unable("a", Status::ambiguous, "flat"), unable("b", Status::below_range, "high"),
       unable("c", Status::insufficient_data, "no channel"), unable("d", Status::above_range, "low")});
  EXPECT_EQ(v.grade, Grade::cannot_tell);
  EXPECT_EQ(v.estimate, -1);
  EXPECT_EQ(v.agreement, "none");
  for (const char* part : {"a: ambiguous (flat)", "b: below_range (high)",
                           "c: insufficient_data (no channel)", "d: above_range (low)"})
    EXPECT_NE(v.message.find(part), std::string::npos) << v.message;
  EXPECT_EQ(combined({}).grade, Grade::cannot_tell);
  EXPECT_EQ(combined({}).estimate, -1);
}

// What the record itself refuses is of more use than what nobody asked for.
TEST(Verdict, NothingSoundSaysFirstWhatTheRecordRefuses) {
  const Verdict v =
      combined({unable("undeclared", Status::insufficient_data, "the rig file declares no such"),
                unable("tried", Status::out_of_domain, "one flank only")});
  EXPECT_EQ(v.message.find("cannot tell; tried: out_of_domain (one flank only); undeclared: "), 0u)
      << v.message;
}

TEST(Verdict, BaselineLimitsTheGrowth) {
  Baseline baseline;
  baseline.backlash = 1.8e-4;
  Verdict v = combined({ok("m", 2.2e-4, 1e-6)}, kLimits, baseline);
  EXPECT_NEAR(v.growth, 0.4e-4, 1e-15);
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_NE(v.message.find("grown by"), std::string::npos) << v.message;
  EXPECT_EQ(combined({ok("m", 2.9e-4, 1e-6)}, kLimits, baseline).grade, Grade::watch);
  EXPECT_EQ(combined({ok("m", 1e-5, 1e-6)}, kLimits, baseline).grade, Grade::good);  // shrunk
  EXPECT_EQ(combined({at_least("m", 3.5e-4)}, kLimits, baseline).grade, Grade::service);
  // A baseline without that number says nothing about growth: the limits hold for the value.
  v = combined({ok("m", 1.6e-4, 1e-6)}, kLimits, Baseline());
  EXPECT_TRUE(std::isnan(v.growth));
  EXPECT_EQ(v.grade, Grade::service);
}

TEST(Verdict, GrowthHasTheUncertaintyOfNowAndThen) {
  Baseline baseline;
  baseline.methods = {"m"};
  baseline.backlash = 5e-5;
  baseline.lower = 5e-5 - 3e-6;
  baseline.upper = 5e-5 + 12e-6;
  Verdict v = combined({ok("m", 1.4e-4, 5e-6)}, kLimits, baseline);
  EXPECT_NEAR(v.growth, 9e-5, 1e-18);
  EXPECT_NEAR(v.growth_lower, 9e-5 - 13e-6, 1e-18);                 // hypot(5, 12)
  EXPECT_NEAR(v.growth_upper, 9e-5 + std::sqrt(34) * 1e-6, 1e-18);  // hypot(5, 3)
  EXPECT_TRUE(mentions(v, "grown by 9e-05 m (95 %: 7.7e-05 to 9.583e-05) since the baseline")) << v.message;
  EXPECT_EQ(v.message.find("good: "), 0u) << v.message;
  v = combined({ok("m", 1.4e-4, 15e-6)}, kLimits, baseline);
  EXPECT_TRUE(mentions(v, "watch, may be good: ")) << v.message;
  EXPECT_FALSE(mentions(v, "other methods"));
  v = combined({ok("b", 1.4e-4, 5e-6)}, kLimits, baseline);
  EXPECT_TRUE(mentions(v, "(by other methods: m)")) << v.message;
  v = combined({at_least("m", 2.62e-4)}, kLimits, baseline);
  EXPECT_NEAR(v.growth, 2e-4, 1e-18);  // above the upper end of the baseline
  EXPECT_TRUE(std::isnan(v.growth_upper));
  EXPECT_EQ(v.grade, Grade::stop);
}

TEST(Verdict, Angles) {
  const Limits limits = {true, 1e-3, 2e-3, 3e-3};
  Verdict v = combined({angles_only(ok("m", 5e-5, 1e-6))}, limits);  // 2.5e-3 rad
  EXPECT_EQ(v.grade, Grade::service);
  EXPECT_NE(v.message.find("0.0025 rad"), std::string::npos) << v.message;
  Baseline baseline;
  baseline.backlash_angle = 2e-3;
  v = combined({angles_only(ok("m", 5e-5, 1e-6))}, limits, baseline);
  EXPECT_NEAR(v.growth, 0.5e-3, 1e-15);
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_EQ(combined({angles_only(ok("m", 5e-5, 1e-6))}, std::nullopt).grade, Grade::ungraded);
  EXPECT_EQ(combined({angles_only(at_least("m", 5e-5))}, limits).grade, Grade::service);
  // A limit in metres cannot grade an angle.
  EXPECT_EQ(combined({angles_only(ok("m", 5e-5, 1e-6))}, kLimits).grade, Grade::cannot_tell);
}

TEST(Verdict, AnEstimateWithoutIntervalIsTheLastChoice) {
  Estimate blind = ok("blind", 5e-5, 1e-6);
  blind.angle_lower = blind.angle_upper = kNaN;
  EXPECT_EQ(combined({blind, ok("m", 5e-5, 1e-5)}).estimate, 1);
  EXPECT_EQ(combined({ok("m", 5e-5, 1e-5), blind}).estimate, 0);
}

TEST(Grade, Names) {
  EXPECT_STREQ(to_string(Grade::good), "good");
  EXPECT_STREQ(to_string(Grade::watch), "watch");
  EXPECT_STREQ(to_string(Grade::service), "service");
  EXPECT_STREQ(to_string(Grade::stop), "stop");
  EXPECT_STREQ(to_string(Grade::ungraded), "ungraded");
  EXPECT_STREQ(to_string(Grade::cannot_tell), "cannot_tell");
}

}  // namespace
}  // namespace backlash::diagnosis
