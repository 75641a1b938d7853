// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/diagnosis/declared_spread.h"
#include "support/curve.h"

namespace backlash::diagnosis {
namespace {

/// A curve of 200 um whose answers may be 5 um too high and, from 0 at its start to 40 um at its end, too
/// low.
MonitoringCurve curve() {
  MonitoringCurve c = test::linear_curve(21);
  DeclaredSpread& spread = c.spread.emplace();
  spread.machines = 64;
  spread.limit = "motor damping";
  for (int i = 0; i < 21; ++i) {
    spread.shape.below.push_back(5e-6);
    spread.shape.above.push_back(2e-6 * i);
  }
  spread.shape.bound = 30e-6;
  spread.skewness = {std::vector<double>(21, 0.0), std::vector<double>(21, 0.0), 0};
  return c;
}

Estimate answer(double lower, double value, double upper, Status status = Status::ok) {
  Estimate e;
  e.status = status;
  e.lower = lower, e.backlash = value, e.upper = upper;
  return e;
}

TEST(DeclaredSpread, WidensByWhatIsLearntNearTheAnswer) {
  Estimate e = answer(70e-6, 75e-6, 80e-6);
  widen(curve(), &DeclaredSpread::shape, e);
  EXPECT_EQ(e.status, Status::ok);
  EXPECT_DOUBLE_EQ(e.backlash, 75e-6);
  EXPECT_NEAR(e.lower, 65e-6, 1e-12);
  EXPECT_NEAR(e.upper, 95e-6, 1e-12);  // between 14 um at 70 um and 16 um at 80 um
  EXPECT_NEAR(e.angle_upper, 95e-6 * test::kCurveToAngle, 1e-9);
  Estimate small = answer(1e-6, 2e-6, 3e-6);
  widen(curve(), &DeclaredSpread::shape, small);
  EXPECT_EQ(small.lower, 0);
}

TEST(DeclaredSpread, AWideIntervalNamesWhatLimitsIt) {
  Estimate narrow = answer(60e-6, 75e-6, 90e-6);  // hardly wider
  widen(curve(), &DeclaredSpread::shape, narrow);
  EXPECT_EQ(narrow.message.find("limited"), std::string::npos) << narrow.message;
  Estimate wide = answer(160e-6, 165e-6, 170e-6);  // with it beyond the end of the curve, as are the machines
  widen(curve(), &DeclaredSpread::shape, wide);
  EXPECT_EQ(wide.status, Status::ok);
  EXPECT_NEAR(wide.lower, 155e-6, 1e-12);
  EXPECT_NEAR(wide.upper, 203e-6, 1e-12);
  EXPECT_NE(wide.message.find("limited by the declared motor damping"), std::string::npos) << wide.message;
}

TEST(DeclaredSpread, BoundsGoDown) {
  Estimate e = answer(190e-6, kNaN, kNaN, Status::above_range);
  widen(curve(), &DeclaredSpread::shape, e);
  EXPECT_EQ(e.status, Status::above_range);
  EXPECT_NEAR(e.lower, 160e-6, 1e-12);
  Estimate low = answer(20e-6, kNaN, kNaN, Status::above_range);
  widen(curve(), &DeclaredSpread::shape, low);
  EXPECT_EQ(low.status, Status::ambiguous);
}

TEST(DeclaredSpread, TouchesNoRefusalAndNothingWithoutASpread) {
  MonitoringCurve c = curve();
  Estimate refused = answer(kNaN, kNaN, kNaN, Status::out_of_domain);
  widen(c, &DeclaredSpread::shape, refused);
  EXPECT_EQ(refused.status, Status::out_of_domain);
  c.spread.reset();
  Estimate e = answer(70e-6, 75e-6, 80e-6);
  widen(c, &DeclaredSpread::shape, e);
  EXPECT_EQ(e.upper, 80e-6);
}

}  // namespace
}  // namespace backlash::diagnosis
