// SPDX-License-Identifier: BSD-3-Clause
// simulate and diagnose_record of an arm with gears as their users run them.
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

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
  /// The rig file with one place replaced.
  void changed(const std::string& name, const std::string& from, const std::string& to) {
    std::string text = read("rig/two_link_arm.yaml");
    for (const auto& [a, b] :
         {std::pair<std::string, std::string>{from, to}, {"two_link_arm.urdf", "rig/two_link_arm.urdf"}}) {
      ASSERT_NE(text.find(a), std::string::npos) << a;
      text.replace(text.find(a), a.size(), b);
    }
    write(name, text);
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
  done("simulate rig/two_link_arm_hidden.yaml --duration 30 --out hidden.csv");
  const Outcome hidden =
      run("diagnose_record hidden.csv --rig rig/two_link_arm_hidden.yaml --json hidden.json");
  EXPECT_EQ(hidden.code, 3);
  expect_contains(hidden.out, "the load holds the teeth on one flank throughout (mesh torque between");
  expect_contains(hidden.out, "motion that passes a pose with shoulder at");
}

/// The same CSV without one of its columns.
std::string without(const std::string& csv, const std::string& column) {
  std::istringstream in(csv);
  std::string out, line;
  std::size_t left_out = std::string::npos;
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::string cell;
    std::size_t i = 0;
    for (; std::getline(cells, cell, ','); ++i) {
      if (left_out == std::string::npos && cell == column) left_out = i;
      if (i != left_out) out += (i == 0 ? "" : ",") + cell;
    }
    out += '\n';
  }
  return out;
}

TEST_F(ArmPlay, AJointWithTheMotorsEncoderAloneIsEstimatedBesideOneWithTwo) {
  done("simulate rig/two_link_arm.yaml --duration 20 --out both.csv");
  write("one.csv", without(read("both.csv"), "elbow/load_position"));
  const Outcome outcome = run("diagnose_record one.csv --rig rig/two_link_arm.yaml --json out.json");
  EXPECT_EQ(outcome.code, 0);
  expect_contains(outcome.out, "elbow: ungraded, play ");
  const std::size_t where = outcome.out.find("  crossings at ");  // of the elbow alone
  EXPECT_GT(where, outcome.out.find("elbow: "));
  expect_contains(outcome.out, "motor's side alone");
  expect_contains(outcome.out, "  crossings at ");
  const auto joints = nlohmann::ordered_json::parse(read("out.json")).at("joints");
  const auto &shoulder = joints.at("shoulder"), &elbow = joints.at("elbow");
  EXPECT_EQ(shoulder.at("estimates").size(), 1u);
  EXPECT_EQ(shoulder.at("estimates").at(0).at("method"), "position_difference");
  EXPECT_FALSE(shoulder.contains("crossings"));
  const double truth = 3e-3;  // the rig file's
  EXPECT_EQ(elbow.at("estimates").at(0).at("message"), "needs load_position");
  EXPECT_EQ(elbow.at("estimates").at(1).at("method"), "gap_traverse");
  EXPECT_NEAR(elbow.at("verdict").at("backlash_angle").get<double>(), truth, 0.1 * truth);
  EXPECT_LE(elbow.at("verdict").at("angle_interval").at(0).get<double>(), truth);
  EXPECT_GE(elbow.at("verdict").at("angle_interval").at(1).get<double>(), truth);
  const auto& crossing = elbow.at("crossings").at(0);
  EXPECT_TRUE(crossing.at("pose").contains("shoulder"));
  EXPECT_EQ(std::abs(crossing.at("flank").get<int>()), 1);
}

TEST_F(ArmPlay, ABagSaysTheSameAsTheCsv) {
  std::vector<nlohmann::ordered_json> joints;
  for (const std::string name : {"run.csv", "run.bag", "run.mcap"}) {
    done("simulate rig/two_link_arm.yaml --duration 20 --seed 7 --out " + name);
    done("diagnose_record " + name + " --rig rig/two_link_arm.yaml --json out.json");
    joints.push_back(nlohmann::ordered_json::parse(read("out.json")).at("joints"));
    for (nlohmann::ordered_json& joint : joints.back()) {
      joint.erase("record");
      joint.erase("time");  // a bag's is that of a clock
    }
    EXPECT_EQ(joints.back().dump(), joints.front().dump()) << name;
  }
}

TEST_F(ArmPlay, LimitsOfAJointGradeIt) {
  changed("limits.yaml", "  - name: elbow",
          "  - name: elbow\n    limits: {backlash_angle: {watch: 1.0e-3, service: 2.0e-3, stop: 9.0e-3}}");
  done("simulate limits.yaml --duration 30 --out run.csv");
  EXPECT_EQ(run("diagnose_record run.csv --rig limits.yaml --json out.json").code, 2);  // elbow: service
}

TEST_F(ArmPlay, WhatDoesNotServeIsRefused) {
  const auto refused = [&](const std::string& line, int code, const std::string& words) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, code) << line;
    expect_contains(outcome.err, words);
  };
  refused("simulate rig/two_link_arm.yaml --duration 1 --out run.txt", 64, "written as .csv, .bag or .mcap");
  refused("simulate rig/two_link_arm.yaml --duration 1 --half-gap 1e-3 --out run.csv", 64, "--half-gap");
  refused("simulate rig/two_link_arm.yaml --out run.csv", 64, "missing --duration");
  changed("bad.yaml", "stiffness: 8000", "stiffness: -1");
  refused("simulate bad.yaml --duration 1 --out run.csv", 65, "stiffness = -1: must be > 0");
  changed("bad.yaml", "rotor_inertia: 0.12 ", "rotor_inertia: 0 ");
  refused("simulate bad.yaml --duration 1 --out run.csv", 65, "rotor_inertia > 0");
  done("simulate rig/two_link_arm.yaml --duration 1 --out short.csv");
  refused("diagnose_record short.csv --rig rig/two_link_arm.yaml --json o.json", 65, "no stretch of 4 s");
  refused("diagnose_record short.csv --rig rig/two_link_arm.yaml --json o.json --method waveform", 64,
          "--method");
}

}  // namespace
}  // namespace backlash::test
