// SPDX-License-Identifier: BSD-3-Clause
// simulate and diagnose_record of an arm with gears as their users run them.
#include <nlohmann/json.hpp>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

class ArmPlay : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::filesystem::create_directory_symlink(package_file("config/two_link_arm"), path("rig"));
  }
};

TEST_F(ArmPlay, FromUrdfToADiagnosisOfEachJoint) {
  done("simulate rig/two_link_arm.yaml --duration 30 --seed 7 --out run.csv");
  done("diagnose_record run.csv --rig rig/two_link_arm.yaml --json out.json");
  const auto joints = nlohmann::ordered_json::parse(read("out.json")).at("joints");
  ASSERT_EQ(joints.size(), 2u);
  const double truth[] = {2e-3, 3e-3};  // the rig file's
  int j = 0;
  for (const auto& [name, joint] : joints.items()) {
    const auto& verdict = joint.at("verdict");
    EXPECT_EQ(verdict.at("grade"), "ungraded") << name;
    EXPECT_NEAR(verdict.at("backlash_angle").get<double>(), truth[j], 0.1 * truth[j]) << name;
    EXPECT_LE(verdict.at("angle_interval").at(0).get<double>(), truth[j]);
    EXPECT_GE(verdict.at("angle_interval").at(1).get<double>(), truth[j]);
    EXPECT_LT(joint.at("mesh_torque").at(0).get<double>(), 0);
    ++j;
  }
  const Outcome hidden = run("diagnose_record run.csv --rig rig/two_link_arm.yaml --json -");
  EXPECT_EQ(hidden.code, 0);
}

TEST_F(ArmPlay, LimitsOfAJointGradeIt) {
  shell(
      "sed 's/^  - name: elbow/&\\n    limits: {backlash_angle: {watch: 1.0e-3, "
      "service: 2.0e-3, stop: 9.0e-3}}/; s#two_link_arm.urdf#rig/&#' rig/two_link_arm.yaml > limits.yaml");
  done("simulate limits.yaml --duration 30 --out run.csv");
  EXPECT_EQ(run("diagnose_record run.csv --rig limits.yaml --json out.json").code, 2);  // elbow: service
}

TEST_F(ArmPlay, WhatDoesNotServeIsRefused) {
  const auto refused = [&](const std::string& line, int code, const std::string& words) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, code) << line;
    expect_contains(outcome.err, words);
  };
  refused("simulate rig/two_link_arm.yaml --duration 1 --out run.bag", 64, "written as .csv");
  refused("simulate rig/two_link_arm.yaml --duration 1 --half-gap 1e-3 --out run.csv", 64, "--half-gap");
  refused("simulate rig/two_link_arm.yaml --out run.csv", 64, "missing --duration");
  shell(
      "sed 's/stiffness: 8000/stiffness: -1/; s#two_link_arm.urdf#rig/&#' rig/two_link_arm.yaml > bad.yaml");
  refused("simulate bad.yaml --duration 1 --out run.csv", 65, "stiffness = -1: must be > 0");
  shell(
      "sed 's/ rotor_inertia: 0.12 / rotor_inertia: 0 /; s#two_link_arm.urdf#rig/&#' rig/two_link_arm.yaml > "
      "bad.yaml");
  refused("simulate bad.yaml --duration 1 --out run.csv", 65, "rotor_inertia > 0");
  done("simulate rig/two_link_arm.yaml --duration 1 --out short.csv");
  refused("diagnose_record short.csv --rig rig/two_link_arm.yaml --json o.json", 65, "no stretch of 4 s");
  refused("diagnose_record short.csv --rig rig/two_link_arm.yaml --json o.json --method waveform", 64,
          "--method");
}

}  // namespace
}  // namespace backlash::test
