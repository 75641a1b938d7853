// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>

#include "backlash_diagnosis/model/axis_unit.h"

namespace backlash::model {
namespace {

TEST(AxisUnit, OfALinearAxisIsForceAndLength) {
  const std::map<std::string, std::string> units = {
      {"kg m^2", "kg"},       {"N m", "N"},       {"rad", "m"},
      {"rad/s", "m/s"},       {"1/rad", "1/m"},   {"1/(N m)", "1/N"},
      {"N m s/rad", "N s/m"}, {"N m/rad", "N/m"}, {"N m s^2/rad^2", "N s^2/m^2"},
      {"N/m", "N/m"},         {"s", "s"},         {"-", "-"}};
  for (const auto& [rotary, linear] : units) {
    EXPECT_EQ(axis_unit(rotary, true), linear);
    EXPECT_EQ(axis_unit(rotary, false), rotary);
  }
}

}  // namespace
}  // namespace backlash::model
