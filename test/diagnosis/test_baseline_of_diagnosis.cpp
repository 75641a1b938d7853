// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/baseline.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"

namespace backlash::diagnosis {
namespace {

Estimate sound(const std::string& method, double value, double half) {
  Estimate e;
  e.method = method;
  e.status = Status::ok;
  e.backlash = value;
  e.lower = value - half;
  e.upper = value + half;
  e.backlash_angle = 50 * value;
  e.angle_lower = 50 * e.lower;
  e.angle_upper = 50 * e.upper;
  return e;
}

Estimate bound(const std::string& method, double lower) {
  Estimate e;
  e.method = method;
  e.status = Status::above_range;
  e.lower = lower;
  e.angle_lower = 50 * lower;
  return e;
}

Diagnosis with(const std::vector<Estimate>& estimates) {
  Diagnosis d;
  d.estimates = estimates;
  d.verdict = combine(estimates, std::nullopt, std::nullopt);
  return d;
}

TEST(HealthyMachine, IsWhatTheVerdictStandsOn) {
  Diagnosis d = with({bound("b", 1e-5), sound("wide", 6e-5, 1e-5), sound("sharp", 5.5e-5, 1e-6)});
  d.apd.emplace();
  d.apd->skewness = 3.25;
  const Baseline b = baseline_of(d, "rig", "digest");
  EXPECT_EQ(b.rig, "rig");
  EXPECT_EQ(b.rig_digest, "digest");
  EXPECT_EQ(b.methods, (std::vector<std::string>{"sharp", "wide"}));
  EXPECT_EQ(b.backlash, d.verdict.backlash);
  EXPECT_EQ(b.lower, d.verdict.lower);
  EXPECT_EQ(b.upper, d.verdict.upper);
  EXPECT_EQ(b.backlash_angle, d.verdict.backlash_angle);
  EXPECT_EQ(b.angle_lower, d.verdict.angle_lower);
  EXPECT_EQ(b.angle_upper, d.verdict.angle_upper);
  EXPECT_EQ(b.skewness, 3.25);
  // Compared with itself nothing has grown.
  const Verdict again = combine(d.estimates, std::nullopt, b);
  EXPECT_EQ(again.growth, 0);
  EXPECT_LT(again.growth_lower, 0);
  EXPECT_GT(again.growth_upper, 0);
}

TEST(HealthyMachine, NeedsAValueThatNobodyContradicts) {
  const auto refused = [](const Diagnosis& d, const std::string& reason) {
    try {
      baseline_of(d, "elbow", "digest");
      ADD_FAILURE() << "accepted; expected: " << reason;
    } catch (const BadData& error) {
      EXPECT_EQ(std::string(error.what()).find("elbow: no baseline, " + reason), 0u) << error.what();
    }
  };
  refused(with({}), "there is no value");
  refused(with({bound("b", 1e-5)}), "there is no value");
  Estimate blind = sound("blind", 5e-5, 1e-6);
  blind.angle_lower = blind.angle_upper = kNaN;
  refused(with({blind}), "there is no value");
  refused(with({sound("a", 5e-5, 1e-6), sound("b", 9e-5, 1e-6)}), "the estimates contradict");
  refused(with({sound("a", 5e-5, 1e-6), sound("b", 5e-5, 1e-6), sound("c", 9e-5, 1e-6)}),
          "the estimates contradict");
}

}  // namespace
}  // namespace backlash::diagnosis
