// SPDX-License-Identifier: BSD-3-Clause
// lost_motion on measured records, and on those of a separate program.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "../support/data.h"
#include "backlash_diagnosis/diagnosis/lost_motion.h"
#include "backlash_diagnosis/record/csv.h"
#include "locked_motor.h"

namespace backlash::diagnosis {
namespace {

using namespace locked_motor;

TEST(LostMotionMeasured, CycloidalGearboxKeepsOrderAndReference) {
  // Play at +-3.5 N m [deg] as read off the plots of these records.
  const std::vector<std::pair<std::string, double>> reference = {
      {"split_preload3", 0.28}, {"split_preload1", 1.10}, {"split_reassembled", 1.74}};
  double previous = 0;
  for (const auto& [name, degrees] : reference) {
    const auto path = test::find_data("measured/cycloidal_" + name + "_play.csv");
    if (!path) GTEST_SKIP() << "measured record of " << name << " is absent";
    const Estimate estimate = estimate_lost_motion(record::read_csv(*path), at(3.5));
    // Reading precision of the plots and the slips of a degree in single ramps: 0.05 deg.
    EXPECT_NEAR(estimate.backlash_angle * 180 / M_PI, degrees, 0.05) << name << ": " << estimate.message;
    expect_contains(estimate, degrees * M_PI / 180);
    EXPECT_GT(estimate.angle_lower, previous) << name;
    previous = estimate.angle_upper;
    ASSERT_TRUE(estimate.components);
    // Half the width of the loop lies between 1 and 3 N m in every one of these plots.
    EXPECT_GT(estimate.components->coulomb, 1) << name;
    EXPECT_LT(estimate.components->coulomb, 3) << name;
    EXPECT_LT(estimate.components->gap, estimate.backlash_angle) << name;
  }
}

TEST(LostMotionMeasured, RigWithKnownHalfGapWithinThreeMicrometres) {
  // Series of input sensor, Hertzian contact and output coupling of the rig that made the records.
  const double radius = 0.014917;
  LostMotionSettings settings = at(0.05);
  settings.subtract_elastic_deflection = true;
  settings.base_radius = radius;
  settings.elastic_uncertainty = 0.02;  // as config/sarkar_1997.yaml
  settings.elastic_deflection = [radius](double torque) {
    return torque / 28.71 + std::pow(torque / radius / 2.28e8, 2.0 / 3) / radius + torque / 6310;
  };
  for (const int half_gap : {0, 30, 55, 80}) {
    const auto path = test::find_data("rig/rig_halfgap_" + std::to_string(half_gap) + "um.csv");
    if (!path) GTEST_SKIP() << "rig record with half gap " << half_gap << " um is absent";
    const Estimate estimate = estimate_lost_motion(record::read_csv(*path), settings);
    const double truth = 2e-6 * half_gap;
    EXPECT_NEAR(estimate.backlash, truth, 3e-6) << estimate.message;  // demanded of the method
    EXPECT_LE(estimate.lower, truth);
    EXPECT_GE(estimate.upper, truth);
    EXPECT_LT(estimate.upper - estimate.lower, 1e-5);  // an interval that still separates steps of 25 um
  }
}

}  // namespace
}  // namespace backlash::diagnosis
