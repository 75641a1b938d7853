// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/baseline.h"

namespace backlash::diagnosis {
namespace {

const std::string kText =
    "schema_version: 1\n"
    "rig: \"sarkar \\\"a\\\"\"\n"
    "rig_digest: \"0123456789abcdef\"\n"
    "methods: [\"lost_motion\", \"apd_skewness\"]\n"
    "backlash: 8e-05\n"
    "interval: [7e-05, 8.25e-05]\n"
    "backlash_angle: 0.004\n"
    "angle_interval: [0.0035, 0.0042]\n"
    "skewness: -0.25\n";

Baseline parse(const std::string& text) {
  return baseline_from_yaml(YamlReader::from_text(text, "healthy.yaml"));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto place = text.find(from);
  EXPECT_NE(place, std::string::npos) << from;
  return text.replace(place, from.size(), to);
}

TEST(Baseline, IsReadAsWritten) {
  const Baseline b = parse(kText);
  EXPECT_EQ(b.rig, "sarkar \"a\"");
  EXPECT_EQ(b.rig_digest, "0123456789abcdef");
  EXPECT_EQ(b.methods, (std::vector<std::string>{"lost_motion", "apd_skewness"}));
  EXPECT_EQ(b.backlash, 8e-5);
  EXPECT_EQ(b.lower, 7e-5);
  EXPECT_EQ(b.upper, 8.25e-5);
  EXPECT_EQ(b.backlash_angle, 0.004);
  EXPECT_EQ(b.angle_lower, 0.0035);
  EXPECT_EQ(b.angle_upper, 0.0042);
  EXPECT_EQ(b.skewness, -0.25);
  const std::string path = ::testing::TempDir() + "/healthy.yaml";
  Baseline odd = b;
  odd.backlash = 0.1 + 0.2;  // all digits
  odd.upper = 0.4;
  write_baseline(odd, path);
  const Baseline back = read_baseline(path);
  EXPECT_EQ(back.backlash, 0.1 + 0.2);
  EXPECT_EQ(to_yaml(back), to_yaml(odd));
  std::remove(path.c_str());
  EXPECT_THROW(read_baseline(path), MissingInput);
  EXPECT_THROW(write_baseline(b, "/nowhere/healthy.yaml"), CannotWrite);
}

TEST(Baseline, OfAnAngularRigHasNoLength) {
  Baseline b =
      parse(replaced(replaced(replaced(kText, "backlash: 8e-05\n", ""), "interval: [7e-05, 8.25e-05]\n", ""),
                     "skewness: -0.25\n", ""));
  EXPECT_TRUE(std::isnan(b.backlash) && std::isnan(b.lower) && std::isnan(b.upper) && std::isnan(b.skewness));
  EXPECT_EQ(b.backlash_angle, 0.004);
  EXPECT_TRUE(std::isnan(parse(to_yaml(b)).backlash));
}

TEST(Baseline, WhatIsNoBaselineIsRefusedWithItsKey) {
  const std::vector<std::vector<std::string>> cases = {
      {"schema_version: 1", "schema_version: 2", "schema_version"},
      {"schema_version: 1\n", "", "schema_version"},
      {"rig_digest: \"0123456789abcdef\"\n", "", "rig_digest"},
      {R"(["lost_motion", "apd_skewness"])", "[]", "methods"},
      {"backlash: 8e-05", "backlash: much", "backlash"},
      {"backlash: 8e-05", "backlash: 9e-05", "interval"},
      {"backlash: 8e-05\n", "", "backlash"},
      {"interval: [7e-05, 8.25e-05]\n", "", "interval"},
      {"[7e-05, 8.25e-05]", "[7e-05]", "interval"},
      {"[0.0035, 0.0042]", "[0.0041, 0.0042]", "angle_interval"},
      {"backlash_angle: 0.004\n", "", "backlash_angle"},
      {"skewness: -0.25", "skewness: .nan", "skewness"},
      {"skewness: -0.25\n", "date: today\n", "date"},
  };
  for (const auto& c : cases) try {
      parse(replaced(kText, c[0], c[1]));
      ADD_FAILURE() << c[0] << " -> " << c[1] << " was accepted";
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find("healthy.yaml"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(c[2]), std::string::npos) << error.what();
    }
}

TEST(Baseline, OfAnotherRigIsRefusedOfAnotherVersionReported) {
  const Baseline b = parse(kText);
  EXPECT_EQ(check_baseline(b, "sarkar \"a\"", "0123456789abcdef", "h.yaml"), "");
  EXPECT_NE(
      check_baseline(b, "sarkar \"a\"", "another", "h.yaml").find("h.yaml was taken with another version"),
      std::string::npos);
  try {
    check_baseline(b, "elbow", "0123456789abcdef", "h.yaml");
    ADD_FAILURE() << "accepted";
  } catch (const BadData& error) {
    EXPECT_STREQ(error.what(), "h.yaml: the baseline is of the rig 'sarkar \"a\"', not of 'elbow'");
  }
}

}  // namespace
}  // namespace backlash::diagnosis
