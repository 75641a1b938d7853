// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/base/yaml_tree.h"
#include "backlash_diagnosis/rig_file/rig_document.h"

namespace backlash::rig_file {
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

std::string with_value(const std::string& key, const std::string& value, const std::string& comment = "") {
  RigDocument document(kText, "t");
  document.set(key, value, comment);
  return document.text();
}

TEST(RigDocument, ReplacesOneValueAndKeepsAllElse) {
  EXPECT_EQ(
      with_value("a", "7"),
      "# head\na: 7   # one\n" + std::string(kText).substr(std::string("# head\na: 1   # one\n").size()));
  const std::string changed = with_value("part.inertia", "5e-4", "found");
  EXPECT_NE(changed.find("\n  inertia: 5e-4                 # found\n"), std::string::npos) << changed;
  EXPECT_EQ(changed.size(), std::string(kText).size() - std::string("kg m^2 [printed]").size() + 5);
  EXPECT_EQ(YamlReader::from_text(changed, "t").map("part").number("inertia", Range::any()), 5e-4);
}

TEST(RigDocument, AddsAnAbsentKeyToItsMap) {
  const std::string changed = with_value("part.deeper.gain", "4", "new");
  const YamlReader deeper = YamlReader::from_text(changed, "t").map("part").map("deeper");
  EXPECT_EQ(deeper.number("gain", Range::any()), 4);
  EXPECT_EQ(deeper.text("law"), "x");
  EXPECT_NE(changed.find("# new\n    law: 'x'\n"), std::string::npos) << changed;
}

TEST(RigDocument, ReplacesAndAddsInAMapOnOneLine) {
  const std::string text = "motor:\n  friction: {forward: 1.5, backward: 1.5}   # N m\n";
  RigDocument document(text, "t");
  document.set("motor.friction.backward", "2");
  EXPECT_EQ(document.text(), "motor:\n  friction: {forward: 1.5, backward: 2}   # N m\n");
  document.set("motor.friction.forward", "1");
  document.set("motor.friction.rest", "3");
  EXPECT_EQ(document.text(), "motor:\n  friction: {rest: 3, forward: 1, backward: 2}   # N m\n");
}

TEST(RigDocument, RefusesWhatItCannotDo) {
  for (const char* key : {"absent.x", "a.x", "part", "part.deeper"})
    EXPECT_THROW(with_value(key, "1"), BadData) << key;
  EXPECT_THROW(RigDocument("- 1\n", "t").set("a", "1"), BadData);
}

const std::string kTerms =
    "runs:\n  - id: cogging\n"
    "terms:  # three\n"
    "  - id: gravity\n    amplitude: 1\n\n"
    "  # of the wheel\n  -\n    id: cogging\n    order: 7\n"
    "  - id: gravity  # again\n    amplitude: 2\n"
    "end: 1\n";

std::string replaced(const std::string& text, const std::string& id) {
  RigDocument document(text, "t");
  document.replace_terms([&](const std::string& other) { return other == id; }, {"  - id: new\n    x: 1\n"});
  return document.text();
}

TEST(RigDocument, ReplacesTheTermsOfAnIdWhereTheFirstOneStood) {
  EXPECT_EQ(replaced(kTerms, "gravity"),
            "runs:\n  - id: cogging\nterms:  # three\n  - id: new\n    x: 1\n\n"
            "  # of the wheel\n  -\n    id: cogging\n    order: 7\nend: 1\n");
  EXPECT_THROW(replaced(kTerms, "delay"), BadData);
  EXPECT_EQ(
      replaced("a:\n  - b\nterms: [{id: gravity}, {id: cogging}]\n", "gravity"),  // not the list above it
      "a:\n  - b\nterms:\n  - id: new\n    x: 1\n  - {id: cogging}\n");
  EXPECT_THROW(replaced("terms: []\n", "gravity"), BadData);
}

TEST(RigDocument, AppendsTermsBehindTheLast) {
  RigDocument document(kTerms, "t");
  document.append_terms({"  - id: new\n    x: 1\n"}, "not said");
  std::string expected = kTerms;
  expected.insert(expected.find("end: 1"), "  - id: new\n    x: 1\n");
  EXPECT_EQ(document.text(), expected);
  RigDocument none("a: 1\nterms: []\n", "t");
  none.append_terms({"  - id: new\n"}, "said");
  EXPECT_EQ(none.text(), "a: 1\n\nterms:                            # said\n  - id: new\n");
}

// A list in brackets, on one line or several, gets lines; what stands in it is not touched.
TEST(RigDocument, AppendsTermsToAListInBrackets) {
  const auto appended = [](const std::string& text) {
    RigDocument document(text, "t");
    document.append_terms({"  - id: new\n    x: 1\n"}, "not said");
    EXPECT_NO_THROW(parse_yaml(document.text(), "t")) << document.text();
    return document.text();
  };
  EXPECT_EQ(appended("terms: [{id: gravity, points: [1, 2]}]  # one\nend: 1\n"),
            "terms:  # one\n  - {id: gravity, points: [1, 2]}\n  - id: new\n    x: 1\nend: 1\n");
  EXPECT_EQ(
      appended("terms: [\n  {id: gravity,  # of the arm, [sic]\n   name: 'a]'}, {id: cogging}\n]\nend: 1\n"),
      "terms:\n  - {id: gravity,  # of the arm, [sic]\n    name: 'a]'}\n  - {id: cogging}\n"
      "  - id: new\n    x: 1\nend: 1\n");
}

TEST(RigDocument, ReplacesAndAddsInNestedBrackets) {
  RigDocument document(
      "gear: {motor: {inertia: 3, friction: {forward: 1, backward: 2}}, mesh: {law: \"x, {y}\"}}  # all\n"
      "sensors: {}\n"
      "long: {a: 1,   # first\n"
      "       b: 2}\n",
      "t");
  document.set("gear.motor.inertia", "5", "not said");
  document.set("gear.motor.friction.backward", "7");
  document.set("gear.motor.viscous", "4");
  document.set("gear.mesh.law", "z");
  document.set("sensors.skew", "1e-3");
  document.set("long.b", "3");
  document.set("long.a", "0");
  EXPECT_EQ(
      document.text(),
      "gear: {motor: {viscous: 4, inertia: 5, friction: {forward: 1, backward: 7}}, mesh: {law: z}}  # all\n"
      "sensors: {skew: 1e-3}\n"
      "long: {a: 0,   # first\n"
      "       b: 3}\n");
  document.set("gear.motor.friction", "9");
  EXPECT_NE(document.text().find("friction: 9}"), std::string::npos) << document.text();
}

TEST(RigDocument, DropsTheCommentsBeforeTheFirstKey) {
  RigDocument document(kText, "t");
  document.drop_head();
  EXPECT_EQ("# head\n" + document.text(), kText);
}

}  // namespace
}  // namespace backlash::rig_file
