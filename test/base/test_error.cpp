// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

TEST(Error, InvalidParameterNamesParameterValueAndLimit) {
  const InvalidParameter error("motor.inertia", -1.5, "must be > 0");
  EXPECT_STREQ(error.what(), "motor.inertia = -1.5: must be > 0");
  EXPECT_EQ(error.name(), "motor.inertia");
  EXPECT_EQ(error.value(), "-1.5");
  EXPECT_EQ(error.limit(), "must be > 0");
}

TEST(Error, InvalidParameterShowsSmallValuesAndTextAsTheyAre) {
  EXPECT_EQ(InvalidParameter("half_gap", 2.5e-5, "x").value(), "2.5e-05");
  EXPECT_STREQ(InvalidParameter("channel", std::string("torque"), "unknown").what(),
               "channel = torque: unknown");
}

TEST(Error, BadDataNamesPlaceAndReason) {
  EXPECT_STREQ(BadData("run.csv:17", "motor_torque = 'abc': not a number").what(),
               "run.csv:17: motor_torque = 'abc': not a number");
}

TEST(Error, CancelledSaysSo) {
  EXPECT_STREQ(Cancelled().what(), "cancelled");
}

// Boundaries catch Error once and distinguish the kinds for the exit code.
template <typename Kind>
bool is_only(const Error& error) {
  const int kinds = (dynamic_cast<const InvalidParameter*>(&error) != nullptr) +
                    (dynamic_cast<const BadData*>(&error) != nullptr) +
                    (dynamic_cast<const MissingInput*>(&error) != nullptr) +
                    (dynamic_cast<const CannotWrite*>(&error) != nullptr) +
                    (dynamic_cast<const IntegrationError*>(&error) != nullptr) +
                    (dynamic_cast<const Cancelled*>(&error) != nullptr);
  return kinds == 1 && dynamic_cast<const Kind*>(&error) != nullptr;
}

TEST(Error, KindsAreErrorsAndDistinct) {
  EXPECT_TRUE(is_only<InvalidParameter>(InvalidParameter("a", 1, "b")));
  EXPECT_TRUE(is_only<BadData>(BadData("a", "b")));
  EXPECT_TRUE(is_only<MissingInput>(MissingInput("a")));
  EXPECT_TRUE(is_only<CannotWrite>(CannotWrite("a")));
  EXPECT_TRUE(is_only<IntegrationError>(IntegrationError("a")));
  EXPECT_TRUE(is_only<Cancelled>(Cancelled()));
}

}  // namespace
}  // namespace backlash
