// SPDX-License-Identifier: BSD-3-Clause
// identify and trace_residual of an arm as their users run them, on measured records.
#include <nlohmann/json.hpp>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

class Arm : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::filesystem::create_directory_symlink(package_file("config/ur10e_arm"), path("rig"));
    for (const char* name : {"a", "b", "free", "payload", "push"}) {
      const auto record = find_data("measured/ur5_arm_" + std::string(name) + ".csv");
      if (!record) GTEST_SKIP() << "no measured/ur5_arm_" << name << ".csv: set BACKLASH_DIAGNOSIS_DATA";
      std::filesystem::create_symlink(std::filesystem::absolute(*record), path(std::string(name) + ".csv"));
    }
  }
  Json json(const std::string& name) const { return Json::parse(read(name)); }
};

const char* const kJoints[] = {"shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
                               "wrist_1_joint",      "wrist_2_joint",       "wrist_3_joint"};

// Somewhat above what doc/measured/ur10e_arm.md has.
TEST_F(Arm, PredictsATrajectoryThatItHasNotSeen) {
  done("identify a.csv b.csv --rig rig/ur10e_arm.yaml --out fitted.yaml --json fit.json");
  const Json fit = json("fit.json");
  for (const auto& [name, link] : fit.at("links").items()) EXPECT_TRUE(link.at("consistent")) << name;
  done("trace_residual --rig fitted.yaml --train a.csv --test free.csv --out out");
  const Json report = json("out/report.json");
  EXPECT_EQ(report.at("verdict"), "nothing_missing");
  EXPECT_TRUE(report.at("steps").empty());
  const double goals[] = {0.038, 0.030, 0.030, 0.046, 0.058, 0.046};
  for (int j = 0; j < 6; ++j) {
    const Json& channel = report.at("channels").at(std::string(kJoints[j]) + "/torque");
    EXPECT_LT(channel.at("after"), goals[j]) << kJoints[j];
    EXPECT_EQ(channel.at("after"), channel.at("before"));
    EXPECT_GT(fit.at("channels").at(std::string(kJoints[j]) + "/torque").at("train"), channel.at("floor"));
  }
}

TEST_F(Arm, RecordsWithAndWithoutABodyContradictEachOther) {
  const Outcome outcome =
      run("identify free.csv payload.csv --rig rig/ur10e_arm.yaml --out f.yaml --json f.json");
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  expect_contains(outcome.out, "warning: The records contradict each other");
  const Json both = json("f.json");
  std::vector<std::string> joints;
  for (const Json& j : both.at("several_machines").at("joints")) joints.push_back(j.at("joint"));
  EXPECT_EQ(joints, std::vector<std::string>(kJoints + 1, kJoints + 6));  // the first axis is vertical
  done("identify free.csv a.csv --rig rig/ur10e_arm.yaml --out f.yaml --json one.json");
  const Json one = json("one.json");
  EXPECT_TRUE(one.at("several_machines").is_null());
  // What the arm without the body has lies within the errors.
  for (const auto& [name, value] : one.at("parameters").items()) {
    if (!both.at("parameters").contains(name)) continue;
    const Json& wide = both.at("parameters").at(name);
    const double error = wide.at("standard_error").is_null() ? 0 : wide.at("standard_error").get<double>(),
                 own = value.at("standard_error").is_null() ? 0 : value.at("standard_error").get<double>();
    EXPECT_NEAR(wide.at("value").get<double>(), value.at("value").get<double>(), 2 * error + 4 * own) << name;
  }
}

TEST_F(Arm, NamesAPayloadThatNothingDeclares) {
  done("trace_residual --rig rig/ur10e_arm.yaml --train free.csv --test payload.csv --out out");
  const Json report = json("out/report.json");
  EXPECT_EQ(report.at("verdict"), "effect_found");
  ASSERT_EQ(report.at("steps").size(), 1u);
  const Json& step = report.at("steps")[0];
  EXPECT_EQ(step.at("effect"), "payload");
  EXPECT_EQ(step.at("link"), "wrist_3_link");
  const Json& mass = step.at("parameters").at("mass");  // 2.805 kg as stated by those who mounted it
  EXPECT_NEAR(mass.at("value").get<double>(), 2.805, 2 * mass.at("standard_error").get<double>());
  for (int j = 1; j < 6; ++j) {
    const Json& channel = report.at("channels").at(std::string(kJoints[j]) + "/torque");
    EXPECT_GT(channel.at("before"), 0.2) << kJoints[j];
    EXPECT_LT(channel.at("after"), 0.05) << kJoints[j];
  }
  // The rig with the payload is a rig: nothing is missing in it.
  const Outcome again =
      run("trace_residual --rig out/rig.yaml --train payload.csv --test payload.csv --out again");
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_TRUE(json("again/report.json").at("steps").empty());
  EXPECT_TRUE(std::filesystem::exists(path("out/report.html")));
}

TEST_F(Arm, FindsAPushWhileItHoldsItsPose) {
  done("trace_residual --rig rig/ur10e_arm.yaml --train free.csv --test push.csv --out out");
  const Json steps = json("out/report.json").at("steps");
  ASSERT_GT(steps.size(), 4u);
  // By eye: joint 1 at 1.84 s, then joints 3, 5, 4, 2; nothing before.
  EXPECT_EQ(steps[0].at("joint"), "shoulder_pan_joint");
  EXPECT_NEAR(steps[0].at("begin").at("value").get<double>(), 1.84, 0.1);
  EXPECT_EQ(steps[1].at("joint"), "elbow_joint");
  for (const Json& step : steps) EXPECT_EQ(step.at("effect"), "external_torque");
}

TEST_F(Arm, RecordsThatDoNotServeAreRefused) {
  const auto code = [&](const std::string& line) {
    return run("trace_residual --rig rig/ur10e_arm.yaml --out out " + line).code;
  };
  EXPECT_EQ(code("--train push.csv --test free.csv"), 3);  // stands still
  write("one.csv", "time,elbow_joint/motor_position,elbow_joint/motor_current\n0,0,0\n1,0,0\n2,0,0\n3,0,0\n");
  EXPECT_EQ(code("--train one.csv --test free.csv"), 65);
  expect_contains(run("identify one.csv --rig rig/ur10e_arm.yaml --out f.yaml --json f.json").err,
                  "no joint 'shoulder_pan_joint'");
  shell("head -n 200 free.csv > short.csv");
  EXPECT_EQ(code("--train short.csv --test free.csv"), 65);
  EXPECT_EQ(code("--train free.csv --test short.csv"), 65);
  EXPECT_EQ(code("--train none.csv --test free.csv"), 66);
  const Outcome single = run("diagnose_record free.csv --json d.json");
  EXPECT_EQ(single.code, 65);
  expect_contains(single.err, "several joints: shoulder_pan_joint, shoulder_lift_joint");
}

}  // namespace
}  // namespace backlash::test
