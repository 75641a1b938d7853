// SPDX-License-Identifier: BSD-3-Clause
// When an answer of earlier samples still counts. Estimates are made up; what counts follows from the header.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/earlier_answer.h"

namespace backlash::diagnosis {
namespace {

constexpr double kToAngle = 50;  // rad/m

Estimate made(const std::string& method, double value, double half, Status status = Status::ok) {
  Estimate e;
  e.method = method;
  e.status = status;
  if (status != Status::ok) return e;
  e.backlash = value, e.lower = value - half, e.upper = value + half;
  e.backlash_angle = kToAngle * value;
  e.angle_lower = kToAngle * e.lower, e.angle_upper = kToAngle * e.upper;
  return e;
}

/// Of samples that ended at 100 s.
EarlierAnswer earlier(const std::vector<Estimate>& others) {
  EarlierAnswer found;
  found.method = "waveform";
  found.end = 100;
  found.estimate = made("waveform", 80e-6, 0.6e-6);
  found.estimate.from_record = found.estimate.fits_machine = true;
  found.estimate.message = "fitted";
  found.others = others;
  return found;
}

/// Samples that end then; of them nothing else is known.
PeriodWindow ended(double when) {
  PeriodWindow window;
  window.record.time = {when};
  return window;
}

/// What is reported at 102.5 s, or at `when`.
Diagnosis answer(const EarlierAnswer& found, const std::vector<Estimate>& now, double when = 102.5) {
  Diagnosis diagnosis;
  diagnosis.estimates = now;
  diagnosis.estimates.push_back(made("waveform", 0, 0, Status::insufficient_data));
  recall(diagnosis, found, ended(when), std::nullopt, std::nullopt);
  return diagnosis;
}

bool counts(const Diagnosis& d) {
  return d.estimates.back().status == Status::ok;
}

TEST(EarlierAnswer, CountsWithItsAgeReported) {
  const Diagnosis d = answer(earlier({made("lost_motion", 79e-6, 5e-6)}), {made("lost_motion", 82e-6, 5e-6)});
  const Estimate& e = d.estimates.back();
  EXPECT_EQ(e.status, Status::ok);
  EXPECT_DOUBLE_EQ(e.age, 2.5);
  EXPECT_EQ(e.message, "fitted; of samples that ended 2.5 s before");
  EXPECT_EQ(d.verdict.members, std::vector<int>{1});
  EXPECT_DOUBLE_EQ(d.verdict.backlash, 80e-6);
  EXPECT_NE(d.verdict.message.find("waveform is of samples that ended 2.5 s before"), std::string::npos);
}

// 79 -> 95 um with 5 um of scatter in each: the machine changed. With wide intervals of declared values, too.
TEST(EarlierAnswer, AMovedMethodShowsAChange) {
  EXPECT_FALSE(counts(answer(earlier({made("a", 79e-6, 5e-6)}), {made("a", 95e-6, 5e-6)})));
  EXPECT_TRUE(counts(answer(earlier({made("a", 79e-6, 9e-6)}), {made("a", 95e-6, 9e-6)})));
  Estimate then = made("a", 79e-6, 25e-6), now = made("a", 95e-6, 25e-6);
  EXPECT_TRUE(counts(answer(earlier({then}), {now})));
  then.declared = now.declared = 24.9e-6 * kToAngle;
  const Diagnosis changed = answer(earlier({then}), {now});
  EXPECT_FALSE(counts(changed));
  EXPECT_NE(changed.estimates.back().message.find("changed since the last answer, by a"), std::string::npos);
  EXPECT_EQ(changed.verdict.members, std::vector<int>{0});
  // A fiftieth of the value is no change, however sharp a method is.
  EXPECT_TRUE(counts(answer(earlier({made("a", 80e-6, 1e-8)}), {made("a", 81e-6, 1e-8)})));
}

TEST(EarlierAnswer, AContradictionCountsWhereThereWasNone) {
  const Estimate mute = made("a", 0, 0, Status::ambiguous), far = made("a", 150e-6, 20e-6);
  EXPECT_FALSE(counts(answer(earlier({mute}), {far})));
  EXPECT_TRUE(counts(answer(earlier({far}), {far})));  // as it was: combine() settles it
  Estimate bound = made("a", 0, 0, Status::ok);
  bound.status = Status::above_range;
  bound.backlash_angle = bound.angle_upper = kNaN;
  bound.angle_lower = kToAngle * 120e-6;
  EXPECT_FALSE(counts(answer(earlier({mute}), {bound})));
}

TEST(EarlierAnswer, NeitherTooOldNorWithoutTheLock) {
  EXPECT_TRUE(counts(answer(earlier({}), {}, 399)));
  EXPECT_FALSE(counts(answer(earlier({}), {}, 401)));
  Diagnosis diagnosis;
  diagnosis.lock_contradicted = "the output turns";
  diagnosis.estimates = {made("waveform", 0, 0, Status::insufficient_data)};
  recall(diagnosis, earlier({}), ended(101), std::nullopt, std::nullopt);
  EXPECT_EQ(diagnosis.estimates.back().status, Status::out_of_domain);
  EXPECT_EQ(diagnosis.estimates.back().message, "the output turns");
}

// A fit that ended after the samples that are diagnosed now: what waits in a queue.
TEST(EarlierAnswer, NoAgeBelowZero) {
  EXPECT_EQ(answer(earlier({}), {}, 99).estimates.back().age, 0);
}

}  // namespace
}  // namespace backlash::diagnosis
