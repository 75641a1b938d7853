// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/studies/curve_builder.h"
#include "backlash_diagnosis/studies/uncertainty_study.h"
#include "support/estimates.h"

namespace backlash::studies {
namespace {

StudyTrial trial(double truth, double estimate, double lower, double upper,
                 diagnosis::Status status = diagnosis::Status::ok) {
  StudyTrial t;
  t.backlash = truth;
  t.noise = 0.02;
  diagnosis::Estimate e;
  e.method = "any";
  e.status = status;
  e.backlash = estimate;
  e.lower = lower;
  e.upper = upper;
  t.estimates = {e};
  return t;
}

TEST(SummariseStudy, CountsByHand) {
  std::vector<StudyTrial> trials = {
      trial(1e-5, 1.1e-5, 0.9e-5, 1.2e-5),  // holds, error 1 um
      trial(2e-5, 2.3e-5, 2.1e-5, 2.5e-5),  // misses by 1 um, error 3 um, width 4 um
      trial(3e-5, 5e-5, 4.9e-5, 5.1e-5),    // 20 um off, width 2 um: confident
      trial(4e-5, kNaN, kNaN, kNaN, diagnosis::Status::out_of_domain),  // cannot tell
      trial(9e-5, 9e-5, 8e-5, 10e-5)};                                  // half gap 45 um: beyond the group
  const std::vector<StudyRow> rows = summarise_study(trials, true, 30e-6);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].trials, 4);
  EXPECT_EQ(rows[0].answered, 3);
  EXPECT_NEAR(rows[0].median_error, 3e-6, 1e-12);
  EXPECT_NEAR(rows[0].p95_error, 18.3e-6, 1e-12);  // of 1, 3 and 20 um at place 0.95 * 2: 3 + 0.9 * 17
  EXPECT_NEAR(rows[0].median_width, 3e-6, 1e-12);
  EXPECT_NEAR(rows[0].coverage, 1 / 3.0, 1e-12);
  EXPECT_NEAR(rows[0].cannot_tell, 0.25, 1e-12);
  EXPECT_EQ(rows[0].wrong_and_sure, 1);
  EXPECT_EQ(summarise_study(trials, true, 30e-6, 0.05)[0].trials, 0);
  EXPECT_EQ(summarise_study(trials, false, 30e-6)[0].trials, 0);
}

TEST(SummariseVariants, NearIsRightFarIsWrong) {
  std::vector<StudyTrial> trials = {trial(1e-5, 1.5e-5, 1.2e-5, 1.8e-5),  // 2 um outside, width 6 um
                                    trial(1e-5, 3e-5, 2.9e-5, 3.1e-5),
                                    trial(1e-5, kNaN, kNaN, kNaN, diagnosis::Status::ambiguous)};
  for (StudyTrial& t : trials) t.variant = "louder";
  const std::vector<VariantRow> rows = summarise_variants(trials);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].variant, "louder");
  EXPECT_EQ(rows[0].right, 1);
  EXPECT_EQ(rows[0].wrong, 1);
  EXPECT_EQ(rows[0].recognised, 1);
}

/// Commissioned: known to a hundredth of what a file without a word knows.
rig_file::RigFile rig() {
  return known_to(rig_file::default_rig_file(), 0.01);
}

const diagnosis::MonitoringCurve& curve() {
  static const diagnosis::MonitoringCurve built = [] {
    CurveRequest request;
    request.points = 41;
    return build_curve(rig(), request);
  }();
  return built;
}

// The full study (600 records) is a command; its figures are in doc/sarkar_1997.md. Here a part of it.
TEST(UncertaintyStudy, IntervalsHoldWhatTheyPromise) {
  StudyRequest request;
  request.records = 48;
  request.seed = 77;  // not that of the documented study
  const auto trials = run_study(rig(), curve(), request);
  ASSERT_EQ(trials.size(), 96u);
  for (const bool position : {true, false})
    for (const StudyRow& row : summarise_study(trials, position, 70e-6)) {
      EXPECT_EQ(row.wrong_and_sure, 0) << row.method;
      // Of 30 to 48 intervals of 95 % more than 7 miss with a probability below 1 %.
      if (row.answered > 0) {
        EXPECT_LE((1 - row.coverage) * row.answered, 7.001) << row.method;
      }
    }
  // The goals are 1 um with position and 6 um from torque alone, in the median at 2 % noise; here at all
  // levels.
  const auto rows = summarise_study(trials, true, 70e-6), alone = summarise_study(trials, false, 70e-6);
  EXPECT_EQ(rows.back().method, "combined");
  EXPECT_LT(rows.back().median_error, 1e-6);
  EXPECT_LT(alone.back().median_error, 6e-6);
}

TEST(UncertaintyStudy, WrongConditionsAreRecognised) {
  StudyRequest request;
  request.seed = 78;
  const auto rows = summarise_variants(run_variants(rig(), curve(), request, 2));
  EXPECT_GE(rows.size(), 13u * 2 * 6);
  for (const VariantRow& row : rows) {
    EXPECT_EQ(row.wrong, 0) << row.variant << ' ' << row.method << ' ' << row.position;
    const bool apd = row.method == "apd_skewness" || row.method == "apd_shape";
    // A free output that nothing shows, and heavy, is as good as locked.
    if (apd && (row.position || row.variant != "output free")) {
      EXPECT_EQ(row.right, 0) << row.variant << ' ' << row.method << ' ' << row.position;
    }
  }
}

TEST(UncertaintyStudy, IsDeterministicForASeedAndRefusesNonsense) {
  StudyRequest request;
  request.records = 2;
  const auto first = run_study(rig(), curve(), request), again = run_study(rig(), curve(), request);
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].backlash, again[i].backlash);
    EXPECT_EQ(test::by("lost_motion", first[i].estimates).message,
              test::by("lost_motion", again[i].estimates).message);
    EXPECT_EQ(test::by("apd_skewness", first[i].estimates).skewness,
              test::by("apd_skewness", again[i].estimates).skewness);
  }
  request.seed = 2;
  EXPECT_NE(run_study(rig(), curve(), request)[0].backlash, first[0].backlash);
  for (const auto& spoil :
       {+[](StudyRequest& r) { r.records = 0; }, +[](StudyRequest& r) { r.max_backlash = -1; },
        +[](StudyRequest& r) { r.noise.clear(); }, +[](StudyRequest& r) { r.noise = {-0.1}; },
        +[](StudyRequest& r) { r.most_periods = 1; }}) {
    StudyRequest bad;
    spoil(bad);
    EXPECT_THROW(run_study(rig(), curve(), bad), InvalidParameter);
  }
}

}  // namespace
}  // namespace backlash::studies
