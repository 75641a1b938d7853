// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "identification/effects/impossible_friction.h"

namespace backlash::identification {
namespace {

const std::map<std::string, std::string> kUnits = {{"motor_coulomb", "N m"},
                                                   {"load_viscous", "N m s/rad"},
                                                   {"motor_coulomb_asymmetry", "N m"},
                                                   {"mesh_stiffness", "N m/rad"}};

/// Motion of 0.5 rad/s under 200 N m: a hundredth of that is worth saying.
std::optional<Unexplained> of(const std::map<std::string, signal::Measured>& fitted) {
  return impossible_friction(fitted, kUnits, {0.5, 200}, {}, {});
}

TEST(ImpossibleFriction, IsNamedWithItsValue) {
  const auto found = of({{"motor_coulomb", {60, 1}}, {"load_viscous", {-13.4, 1.7}}});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->channel, "torque");
  EXPECT_NE(found->signature.find("load_viscous -13.4 +- 1.7 N m s/rad"), std::string::npos)
      << found->signature;
}

TEST(ImpossibleFriction, IsNoneThatMayBeZero) {
  EXPECT_FALSE(of({{"load_viscous", {-13.4, 4}}}));  // 3.4 standard errors
}

// 1 N m s/rad at 0.5 rad/s is a four-hundredth of the torque; as dry friction 1 N m would be a two-hundredth.
TEST(ImpossibleFriction, IsNoneThatIsTooSmallToMatter) {
  EXPECT_FALSE(of({{"load_viscous", {-1, 0.1}}, {"motor_coulomb", {-1, 0.1}}}));
  EXPECT_TRUE(of({{"motor_coulomb", {-2.1, 0.1}}}));
}

// A difference between the directions has either sign, and what is no friction is not meant.
TEST(ImpossibleFriction, IsNoDifferenceOfDirections) {
  EXPECT_FALSE(of({{"motor_coulomb_asymmetry", {-20, 1}}, {"mesh_stiffness", {-20, 1}}}));
}

TEST(ImpossibleFriction, TheOneFarthestBelowZeroIsNamed) {
  const auto found = of({{"motor_coulomb", {-30, 1}}, {"load_viscous", {-13.4, 1.7}}});
  ASSERT_TRUE(found);
  EXPECT_NE(found->signature.find("motor_coulomb"), std::string::npos) << found->signature;
}

}  // namespace
}  // namespace backlash::identification
