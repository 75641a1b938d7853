// SPDX-License-Identifier: BSD-3-Clause
// detect_changes as a user calls it, on records of a joint with known changes.
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

class DetectChanges : public CommandTest {};

TEST_F(DetectChanges, TellsEachChangeOfTheSharedRecordsAndNothingElse) {
  const auto truth_file = find_data("changes/truth.json");
  if (!truth_file) GTEST_SKIP() << "changes/truth.json is not there";
  std::ifstream in(*truth_file);
  const Json records = Json::parse(in)["records"];
  const std::map<std::string, std::string> names = {{"friction_up", "motor_coulomb"}, {"payload", "gravity"}};
  for (const auto& [name, truth] : records.items()) {
    const std::string record = *find_data("changes/" + name + ".csv");
    const Outcome outcome = run("detect_changes --rig " + package_file("config/ur5_joint.yaml") +
                                " --healthy " + *find_data("changes/healthy_a.csv") + " " +
                                *find_data("changes/healthy_b.csv") + " --json out.json " + record);
    ASSERT_EQ(outcome.code, truth["since"].is_null() ? 0 : 2) << outcome.err;
    const Json json = Json::parse(read("out.json"));
    EXPECT_EQ(json["schema_version"], 1);
    EXPECT_GT(json["windows"], 40);
    if (truth["since"].is_null()) {
      EXPECT_TRUE(json["changes"].empty()) << name << "\n" << outcome.out;
      continue;
    }
    ASSERT_EQ(json["changes"].size(), 1u) << name << "\n" << outcome.out;
    const Json change = json["changes"][0];
    EXPECT_EQ(change["effect"], names.count(name) ? names.at(name) : name);
    EXPECT_NEAR(change["since"].get<double>(), truth["since"].get<double>(), 1);
    EXPECT_LE(change["since_interval"][0], truth["since"]);
    EXPECT_GE(change["since_interval"][1], truth["since"]);
    EXPECT_TRUE(change["until"].is_null());
    EXPECT_FALSE(change["size"].empty());
  }
}

TEST_F(DetectChanges, RefusesMoreThanOneInertia) {
  write("record.csv", "time,motor_torque,motor_position\n0,0,0\n0.1,0,0\n0.2,0,0\n");
  const Outcome outcome = run("detect_changes --rig " + package_file("config/two_inertia_servo.yaml") +
                              " --healthy record.csv --json out.json record.csv");
  EXPECT_EQ(outcome.code, 3);
  expect_contains(outcome.err, "one inertia");
  EXPECT_FALSE(exists("out.json"));
}

}  // namespace
}  // namespace backlash::test
