// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/term.h"

namespace backlash::model {
namespace {

YamlReader parse(const std::string& text) {
  return YamlReader::from_text(text, "rig.yaml");
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const BadData& error) {
    return error.what();
  }
  return "nothing thrown";
}

Motion at_load(double position) {
  return {0.5, 1, 2, position, 4};
}

TEST(Term, RegistryHasUniqueIdsAndDescribedParameters) {
  std::set<std::string> ids;
  for (const TermType& type : term_types()) {
    EXPECT_TRUE(ids.insert(type.id).second) << type.id << " is listed twice";
    EXPECT_NE(type.create, nullptr) << type.id;
    std::set<std::string> names;
    for (const ParameterSpec& spec : type.parameters) {
      EXPECT_TRUE(names.insert(spec.name).second) << type.id << "." << spec.name;
      EXPECT_FALSE(spec.unit.empty()) << type.id << "." << spec.name;
      EXPECT_FALSE(spec.meaning.empty()) << type.id << "." << spec.name;
    }
  }
  EXPECT_EQ(ids.count("gravity"), 1u);
}

TEST(Term, GravityPullsTheLinkDown) {
  const auto gravity = read_term(parse("{id: gravity, amplitude: 2.5, phase: 0.3}"));
  for (double q = -7; q < 7; q += 0.37) {
    EndTorques ends;
    gravity->add(at_load(q), ends);
    EXPECT_EQ(ends.motor, 0);
    EXPECT_DOUBLE_EQ(ends.load, -2.5 * std::sin(q + 0.3));
  }
  EndTorques right_of_the_bottom;
  gravity->add(at_load(0.1), right_of_the_bottom);
  EXPECT_LT(right_of_the_bottom.load, 0);  // back to hanging
}

TEST(Term, ContributionsAddUp) {
  const auto gravity = read_term(parse("{id: gravity, amplitude: 1, phase: 0}"));
  EndTorques ends{3, 4};
  gravity->add(at_load(0.5), ends);
  gravity->add(at_load(0.5), ends);
  EXPECT_EQ(ends.motor, 3);
  EXPECT_DOUBLE_EQ(ends.load, 4 - 2 * std::sin(0.5));
}

TEST(Term, RefusalNamesFileLineKeyValueAndLimit) {
  const struct {
    const char* text;
    const char* message;
  } cases[] = {
      {"amplitude: 1\nphase: 0\n", "rig.yaml:1: id: is missing, expected one of "},
      {"id: levitation\n", "rig.yaml:1: id = levitation: must be one of "},
      {"id: [gravity]\n", "rig.yaml:1: id = [...]: must be one of "},
      {"id: gravity\nphase: 0\n", "rig.yaml:1: amplitude: is missing, expected a number"},
      {"id: gravity\namplitude: 1\n", "rig.yaml:1: phase: is missing, expected a number"},
      {"id: gravity\namplitude: -1\nphase: 0\n", "rig.yaml:2: amplitude = -1: must be >= 0"},
      {"id: gravity\namplitude: 1\nphase: up\n", "rig.yaml:3: phase = up: not a number"},
      {"id: gravity\namplitude: 1\nphase: .inf\n", "rig.yaml:3: phase = .inf: not a finite number"},
      {"id: gravity\namplitude: 1\nphase: 0\nmass: 2\n", "rig.yaml:4: mass = 2: unknown key"},
  };
  for (const auto& bad : cases) {
    const std::string message = message_of([&] {
      const YamlReader yaml = parse(bad.text);
      read_term(yaml);
      yaml.finish();
    });
    EXPECT_EQ(message.substr(0, std::string(bad.message).size()), bad.message);
  }
}

}  // namespace
}  // namespace backlash::model
