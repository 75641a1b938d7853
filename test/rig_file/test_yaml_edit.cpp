// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/rig_file/yaml_edit.h"

namespace backlash {
namespace {

const char* const kText =
    "# head\n"
    "a: 1   # one\n"
    "part:\n"
    "  # inside\n"
    "  inertia: 2.24e-5              # kg m^2 [printed]\n"
    "  deeper:\n"
    "    law: 'x'\n"
    "  flow: {inertia: 3}\n";

TEST(YamlEdit, ReplacesOneValueAndKeepsAllElse) {
  EXPECT_EQ(
      with_yaml_value(kText, "t", "a", "7"),
      "# head\na: 7   # one\n" + std::string(kText).substr(std::string("# head\na: 1   # one\n").size()));
  const std::string changed = with_yaml_value(kText, "t", "part.inertia", "5e-4", "found");
  EXPECT_NE(changed.find("\n  inertia: 5e-4                 # found\n"), std::string::npos) << changed;
  EXPECT_EQ(changed.size(), std::string(kText).size() - std::string("kg m^2 [printed]").size() + 5);
  EXPECT_EQ(YamlReader::from_text(changed, "t").map("part").number("inertia", Range::any()), 5e-4);
}

TEST(YamlEdit, AddsAnAbsentKeyToItsMap) {
  const std::string changed = with_yaml_value(kText, "t", "part.deeper.gain", "4", "new");
  const YamlReader deeper = YamlReader::from_text(changed, "t").map("part").map("deeper");
  EXPECT_EQ(deeper.number("gain", Range::any()), 4);
  EXPECT_EQ(deeper.text("law"), "x");
  EXPECT_NE(changed.find("# new\n    law: 'x'\n"), std::string::npos) << changed;
}

TEST(YamlEdit, RefusesWhatItCannotDo) {
  for (const char* key : {"absent.x", "a.x", "part", "part.flow.inertia", "part.deeper.law"})
    EXPECT_THROW(with_yaml_value(kText, "t", key, "1"), BadData) << key;
  EXPECT_THROW(with_yaml_value("- 1\n", "t", "a", "1"), BadData);
}

}  // namespace
}  // namespace backlash
