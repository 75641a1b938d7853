// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/diagnosis/estimate.h"
#include "backlash_diagnosis/diagnosis/limits.h"

namespace backlash::diagnosis {
namespace {

TEST(Limits, ReadAndRefuse) {
  const auto read = [](const std::string& text) {
    return read_limits(YamlReader::from_text(text, "rig.yaml"));
  };
  const Limits limits = read("backlash: {watch: 1e-4, service: 2e-4, stop: 3e-4}");
  EXPECT_FALSE(limits.angular);
  EXPECT_EQ(limits.watch, 1e-4);
  EXPECT_EQ(limits.service, 2e-4);
  EXPECT_EQ(limits.stop, 3e-4);
  EXPECT_TRUE(read("backlash_angle: {watch: 1, service: 2, stop: 3}").angular);
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"backlash: {watch: 2, service: 1, stop: 3}", "service"},
      {"backlash: {watch: 1, service: 1, stop: 3}", "service = 1: must be > watch"},
      {"backlash: {watch: 1, service: 3, stop: 2}", "stop"},
      {"backlash: {watch: 1, service: 3, stop: 3}", "stop = 3: must be > service"},
      {"backlash: {watch: 0, service: 1, stop: 2}", "watch"},
      {"backlash: {watch: 1, service: 2}", "stop"},
      {"backlash: {watch: 1, service: 2, stop: .inf}", "stop"},
      {"backlash: 3", "backlash"},
      {"play: {watch: 1, service: 2, stop: 3}", "backlash"}};
  for (const auto& [text, key] : cases) try {
      read(text);
      ADD_FAILURE() << text << " was accepted";
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
}

/// What the live server refuses, it refuses by the same rule.
TEST(Limits, IncreaseWhereverTheyComeFrom) {
  EXPECT_NO_THROW(require_increasing({false, 1, 2, 3}));
  const std::vector<std::pair<Limits, std::string>> cases = {{{false, 0, 2, 3}, "watch"},
                                                             {{false, 2, 2, 3}, "service"},
                                                             {{true, 1, 3, 3}, "stop"},
                                                             {{true, 1, 2, kNaN}, "stop"},
                                                             {{false, 1, INFINITY, INFINITY}, "service"}};
  for (const auto& [limits, name] : cases) try {
      require_increasing(limits);
      ADD_FAILURE() << name << " was accepted";
    } catch (const InvalidParameter& error) {
      EXPECT_EQ(error.name(), name);
    }
}

}  // namespace
}  // namespace backlash::diagnosis
