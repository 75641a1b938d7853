// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/identification/several_machines.h"

namespace backlash::identification {
namespace {

RecordAlone record(const std::string& name, double inertia, double friction, double left) {
  return {name, {{"load_inertia", {inertia, 0.1}}, {"motor_coulomb", {friction, 0.2}}}, left};
}

TEST(SeveralMachines, AreNamedByTheValuesThatClearlyDiffer) {
  const auto found = several_machines(
      {record("a.csv", 108, 60, 1), record("b.csv", 150, 60.5, 1.1), record("c.csv", 109, 50, 1)}, 100);
  ASSERT_TRUE(found);
  // 42 / sqrt(0.02) errors against 10.5 / sqrt(0.08).
  EXPECT_EQ(found->names, (std::vector<std::string>{"load_inertia", "motor_coulomb"}));
  const std::string text = description(*found, {{"load_inertia", "kg m^2"}, {"motor_coulomb", "N m"}}, true);
  EXPECT_NE(text.find("at most 1.1 times the noise is left, of all together 100 times"), std::string::npos)
      << text;
  EXPECT_NE(text.find("load_inertia 108 +- 0.1 in a.csv, 150 +- 0.1 in b.csv, 109 +- 0.1 in c.csv (kg); "
                      "motor_coulomb 60 +- 0.2 in a.csv, 60.5 +- 0.2 in b.csv, 50 +- 0.2 in c.csv (N)"),
            std::string::npos)
      << text;
}

TEST(SeveralMachines, AreNotReportedWhereTheModelLacksSomethingOrNothingDiffers) {
  // More than noise is left of one alone, and more than a fifth of what all leave.
  EXPECT_FALSE(several_machines({record("a.csv", 108, 60, 1), record("b.csv", 150, 60, 4)}, 10));
  EXPECT_TRUE(several_machines({record("a.csv", 108, 60, 1), record("b.csv", 150, 60, 4)}, 100));
  EXPECT_FALSE(
      several_machines({record("a.csv", 108, 60, 1), record("b.csv", 109, 60.9, 1)}, 10));       // below 2 %
  EXPECT_FALSE(several_machines({record("a.csv", 1, 60, 1), record("b.csv", 1.6, 60, 1)}, 10));  // 4.2 errors
  RecordAlone other = record("b.csv", 150, 60, 1);
  other.values.erase("load_inertia");
  EXPECT_FALSE(several_machines({record("a.csv", 108, 60, 1), other}, 10));
}

}  // namespace
}  // namespace backlash::identification
