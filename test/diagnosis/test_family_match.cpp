// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/diagnosis/family_match.h"
#include "support/curve.h"

namespace backlash::diagnosis {
namespace {

/// Distributions uniform over [-1, 1] at backlash 0, wider by `kWider` per point; the same beyond the curve.
constexpr double kWider = 0.1;

Quantiles uniform(double half_width) {
  Quantiles q(kQuantiles);
  for (int k = 0; k < kQuantiles; ++k) q[k] = half_width * (2 * (k + 0.5) / kQuantiles - 1);
  return q;
}

MonitoringCurve curve_with_family(double threshold, double misfit) {
  MonitoringCurve curve = test::linear_curve(11);
  ApdFamily& family = curve.family.emplace();
  for (int i = 0; i < 16; ++i) family.members.push_back({uniform(1 + kWider * i)});
  FamilySegment segment;
  segment.floor = 1e-4;
  segment.threshold.assign(curve.noise_levels.size(), threshold);
  segment.misfit.assign(curve.noise_levels.size(), misfit);
  family.segments.assign(10, segment);
  return curve;
}

/// Samples whose quantiles are exactly those of a member at `place` (in points of the curve).
std::vector<double> samples_at(double place) {
  return uniform(1 + kWider * place);
}

TEST(FamilyMatch, BestAndIntervalInClosedForm) {
  const MonitoringCurve curve = curve_with_family(4, 1);
  const FamilyMatch match = match_family(curve, samples_at(3.4), {0, 0});
  const double step = test::kCurveEnd / 10;
  EXPECT_NEAR(match.backlash, 3.4 * step, 1e-12);
  EXPECT_NEAR(match.misfit, 0, 1e-7);
  // Two uniform distributions differ by d x in their quantiles, x uniform on [-1, 1] at 100 midpoints: rms
  // d sqrt((1 - 1e-4) / 3). Accepted up to sqrt(threshold floor) = 0.02.
  const double reach = 0.02 / (kWider * std::sqrt((1 - 1e-4) / 3));
  EXPECT_NEAR(match.lower, (3.4 - reach) * step, 1e-9);
  EXPECT_NEAR(match.upper, (3.4 + reach) * step, 1e-9);
  EXPECT_FALSE(match.touches_end || match.fits_no_member());
}

TEST(FamilyMatch, BeyondTheCurveIsSeen) {
  const MonitoringCurve curve = curve_with_family(4, 1);
  const FamilyMatch match = match_family(curve, samples_at(13.2), {0, 0});
  EXPECT_TRUE(match.touches_end);
  EXPECT_EQ(match.lower, test::kCurveEnd);
  EXPECT_EQ(match.upper, test::kCurveEnd);
  EXPECT_FALSE(match_family(curve, samples_at(9.2), {0, 0}).touches_end);
}

TEST(FamilyMatch, WhatResemblesNoMemberIsAlien) {
  const MonitoringCurve curve = curve_with_family(1, 0.05);
  std::vector<double> shifted = samples_at(5);
  for (double& v : shifted) v += 0.06;  // less than 1.25 times the usual misfit of 0.05
  EXPECT_FALSE(match_family(curve, shifted, {0, 0}).fits_no_member());
  for (double& v : shifted) v += 0.06;
  const FamilyMatch match = match_family(curve, shifted, {0, 0});
  EXPECT_TRUE(match.fits_no_member());
  EXPECT_NEAR(match.misfit, 0.12, 1e-6);  // a shift is what no width can mend
}

TEST(FamilyMatch, UnknownNoiseWidensTheInterval) {
  const MonitoringCurve curve = curve_with_family(4, 1);
  const FamilyMatch known = match_family(curve, samples_at(5), {0, 0});
  const FamilyMatch unknown = match_family(curve, samples_at(5), {0, 0.01});
  EXPECT_LE(unknown.lower, known.lower);
  EXPECT_GE(unknown.upper, known.upper);
}

}  // namespace
}  // namespace backlash::diagnosis
