// SPDX-License-Identifier: BSD-3-Clause
// What is reported of changes that were put together by hand.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "backlash_diagnosis/changes/change_report.h"

namespace backlash::changes {
namespace {

TEST(ChangeReport, AJointThatWasNotJudgedIsNotCalledHealthy) {
  Changes found;
  EXPECT_EQ(change_summary(found), "no change found\n0 windows of motion judged\n");
  found.unjudged = {{"elbow", "moves for 2 s"}};
  const std::string text = change_summary(found);
  EXPECT_NE(text.find("no change found of the joints that could be judged\n"), std::string::npos) << text;
  EXPECT_NE(text.find("not judged: elbow: moves for 2 s\n"), std::string::npos) << text;
  const auto json = nlohmann::json::parse(change_json(found, {}));
  ASSERT_EQ(json["unjudged"].size(), 1U);
  EXPECT_EQ(json["unjudged"][0]["joint"], "elbow");
  EXPECT_EQ(json["unjudged"][0]["why"], "moves for 2 s");
}

}  // namespace
}  // namespace backlash::changes
