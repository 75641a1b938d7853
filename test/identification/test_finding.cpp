// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/identification/finding.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "support/servo.h"

namespace backlash::identification {
namespace {

const std::vector<std::string> kInertias = {"motor_inertia", "load_inertia"};

TEST(Finding, TwoMeasurementsOfOneParameterAreWeighted) {
  const model::Rig rig = test::servo_file().rig;
  const auto found = combine_findings(
      {{"a", {{"motor_inertia", 1}}, {7.0, 0.01}}, {"b", {{"motor_inertia", 1}}, {7.03, 0.02}}}, rig,
      kInertias);
  // (7.0 / 0.01^2 + 7.03 / 0.02^2) / (1 / 0.01^2 + 1 / 0.02^2) = 7.006, error 1 / sqrt(12500) = 0.00894,
  // grown by sqrt(chi^2) = 0.03 / sqrt(0.01^2 + 0.02^2) = 1.342 for one degree of freedom. What is declared
  // (6.3 +- 40 %) pulls by 1e-5.
  EXPECT_NEAR(found.at("motor_inertia").value, 7.006, 1e-4);
  EXPECT_NEAR(found.at("motor_inertia").standard_error, 0.00894 * 1.342, 1e-4);
  EXPECT_EQ(found.count("load_inertia"), 0u);  // nothing determines it
}

TEST(Finding, DriveMinusMotorIsTheLoad) {
  const model::Rig rig = test::servo_file().rig;
  const auto found = combine_findings({{"motor", {{"motor_inertia", 1}}, {7, 0.03}},
                                       {"drive", {{"motor_inertia", 1}, {"load_inertia", 1}}, {100, 0.04}}},
                                      rig, kInertias);
  EXPECT_NEAR(found.at("load_inertia").value, 93, 1e-2);
  EXPECT_NEAR(found.at("load_inertia").standard_error, 0.05, 1e-3);  // 3, 4, 5
}

TEST(Finding, ASumAloneIsSplitAsDeclared) {
  // 6.3 and 108 declared, each +- 40 %: 11.43 too much goes to the load but for 6.3^2 / (6.3^2 + 108^2) =
  // 0.34 %.
  const auto found =
      combine_findings({{"drive", {{"motor_inertia", 1}, {"load_inertia", 1}}, {125.73, 0.01}}},
                       test::servo_file().rig, kInertias);
  EXPECT_NEAR(found.at("load_inertia").value, 108 + 11.43 * 0.9966, 1e-2);
  EXPECT_NEAR(found.at("motor_inertia").value, 6.3 + 11.43 * 0.0034, 1e-2);
  EXPECT_GT(found.at("motor_inertia").standard_error, 2);  // still 40 %
}

TEST(Finding, WithoutErrorItDoesNotCount) {
  const auto found =
      combine_findings({{"a", {{"motor_inertia", 1}}, {7, std::nan("")}}}, test::servo_file().rig, kInertias);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace backlash::identification
