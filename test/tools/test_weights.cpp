// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "tools/common/weights.h"

namespace backlash::tools {
namespace {

void expect_mass(const std::string& text, double mass, double error) {
  const Weight weight = parse_weight(text);
  ASSERT_TRUE(weight.mass) << text;
  EXPECT_DOUBLE_EQ(weight.mass->value, mass) << text;
  EXPECT_DOUBLE_EQ(weight.mass->standard_error, error) << text;
}

TEST(Weights, AreReadAsPeopleWriteThem) {
  for (const char* text : {"2.805 kg +- 0.005", "2.805 kg +- 0.005 kg", "2.805 +- 0.005 kg", "2.805kg+-5 g",
                           " 2805 g +/- 5 ", "2.805 kg \u00b1 0.005"})
    expect_mass(text, 2.805, 0.005);
  expect_mass("2 kg +- 1 %", 2, 0.02);
  expect_mass("1 kg", 1, 0);
  EXPECT_FALSE(parse_weight("unknown").mass);
  EXPECT_FALSE(parse_weight("1 kg").lever);
  EXPECT_DOUBLE_EQ(*parse_weight("1 kg +- 1 % at 0.15 m").lever, 0.15);
  EXPECT_DOUBLE_EQ(*parse_weight("1 kg at 150 mm").lever, 0.15);
}

TEST(Weights, OthersAreRefused) {
  for (const char* text : {"", "2.805", "heavy", "-1 kg", "0 kg", "1 kg +- 0", "1 kg +- -1", "1 kg at 0 m",
                           "1 lb", "1 +- 5 %", "1..2 kg", "1 kg at 1"})
    EXPECT_THROW(parse_weight(text), UsageError) << text;
}

std::vector<std::optional<Weight>> of(const std::vector<std::string>& words) {
  Command c;
  c.positional = {"RECORD..."};
  c.options = {{"payload", "WEIGHT", "", false, true}, {"rig", "R", ""}};
  return weights_of(parse_arguments(c, words));
}

TEST(Weights, BelongToTheFirstRecordOrToTheOneThatIsNamed) {
  const auto first = of({"--payload", "1 kg", "with.csv", "without.csv", "--rig", "r"});
  ASSERT_EQ(first.size(), 2u);
  EXPECT_TRUE(first[0]);
  EXPECT_FALSE(first[1]);
  const auto named =
      of({"a/x.csv", "b/y.csv", "c/z.csv", "--payload", "y.csv=1 kg", "--payload", "c/z.csv=unknown"});
  EXPECT_FALSE(named[0]);
  EXPECT_EQ(named[1]->mass->value, 1);
  EXPECT_FALSE(named[2]->mass);
  EXPECT_FALSE(of({"a.csv"})[0]);
  EXPECT_THROW(of({"a.csv", "--payload", "b.csv=1 kg"}), UsageError);
  EXPECT_THROW(of({"a.csv", "--payload", "1 kg", "--payload", "2 kg"}), UsageError);
  EXPECT_THROW(of({"a/x.csv", "b/x.csv", "--payload", "x.csv=1 kg"}), UsageError);
}

}  // namespace
}  // namespace backlash::tools
