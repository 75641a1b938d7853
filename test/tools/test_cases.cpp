// SPDX-License-Identifier: BSD-3-Clause
// Records of machines as people report them, with the answers that are known to be right (the README beside
// each).
#include <map>
#include <nlohmann/json.hpp>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

class Cases : public CommandTest {
 protected:
  /// Path of a file of a case; nothing where the records are not there.
  static std::string file(const std::string& name) { return find_data("cases/" + name).value_or(""); }
  Json json(const std::string& name) const { return Json::parse(read(name)); }
};

#define SKIP_WITHOUT(name) \
  if (file(name).empty()) GTEST_SKIP() << "cases/" << name << " is not there"

// A tenth of a second of torque is noise, 141 % of it is not what a machine leaves that lacks nothing.
TEST_F(Cases, AHundredAndFortyPercentOfTheTorqueAreNotNothing) {
  SKIP_WITHOUT("nothing_missing_141");
  const std::string folder = file("nothing_missing_141");
  const Outcome outcome = run("trace_residual --rig " + folder + "/rig.yaml --train " + folder +
                              "/train.csv --test " + folder + "/test.csv --out out");
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_EQ(json("out/report.json")["verdict"], "unexplained");
}

// Gravity holds one flank in both records, and nothing of it is declared: 139 % of the torque are left.
TEST_F(Cases, OneFlankOfAMachineOfAnotherKindHasNoPlay) {
  SKIP_WITHOUT("A30_identify_wrong_and_sure");
  const std::string folder = file("A30_identify_wrong_and_sure");
  for (const std::string name : {"record", "record2"})
    ASSERT_EQ(shell("gunzip -c " + folder + "/" + name + ".csv.gz | cat >" + name + ".csv; true").code, 0);
  const Outcome outcome =
      run("identify record.csv record2.csv --rig " + folder + "/rig.yaml --out f.yaml --json x.json");
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_TRUE(json("x.json")["parameters"]["backlash_angle"]["standard_error"].is_null());
  EXPECT_EQ(read("f.yaml"), content(folder + "/rig.yaml"));
}

// Friction that may wander follows the brake, and is off before it began at 82.55 s: that is no change.
TEST_F(Cases, ABrakeThatDragsNowAndThenBeginsWhereItBegins) {
  SKIP_WITHOUT("D16_unknown_since_too_early");
  const std::string folder = file("D16_unknown_since_too_early");
  for (const std::string name : {"h1", "h2", "record"})
    ASSERT_EQ(shell("gunzip -c " + folder + "/" + name + ".csv.gz | cat >" + name + ".csv; true").code, 0);
  EXPECT_EQ(
      run("detect_changes record.csv --rig " + folder + "/rig.yaml --healthy h1.csv h2.csv --json x.json")
          .code,
      2);
  const Json report = json("x.json");
  ASSERT_EQ(report["changes"].size(), 1u);
  EXPECT_LE(report["changes"][0]["since_interval"][0].get<double>(), 82.55);
  EXPECT_GE(report["changes"][0]["since_interval"][1].get<double>(), 82.55);
}

// 0.5 % of the cells without a number, and an encoder that is read at a quarter of the rate: the machine of
// truth.json is found as in the whole record.
TEST_F(Cases, CellsWithoutANumberAndHeldValuesDoNotCount) {
  const std::string folder = find_data("robot_joints/servo_00").value_or("");
  if (folder.empty()) GTEST_SKIP() << "robot_joints is not there";
  const double truth = Json::parse(content(folder + "/truth.json"))["backlash_angle"];
  for (const std::string spoil : {"NR > 1 && NR % 200 == 7 { $(2 + NR % 3) = \"nan\" } 1",
                                  "NR > 1 { if (NR % 4) $4 = held; held = $4 } 1"}) {
    ASSERT_EQ(shell("awk -F, -v OFS=, '" + spoil + "' " + folder + "/m0.csv > a.csv && true").code, 0);
    const Outcome outcome = run("diagnose_record a.csv --rig " + folder + "/rig.yaml --json x.json");
    const Json interval = json("x.json")["verdict"]["angle_interval"];
    ASSERT_FALSE(interval.is_null()) << outcome.out << outcome.err;
    EXPECT_LE(interval[0].get<double>(), truth) << spoil;
    EXPECT_GE(interval[1].get<double>(), truth) << spoil;
    EXPECT_LT(interval[1].get<double>() - interval[0].get<double>(), 0.25 * truth) << spoil;
  }
}

// Machines of another simulator, with seconds missing: the parts before and after are fitted together. Three
// standard errors: one of 300 values is farther off by chance.
TEST_F(Cases, ALongGapCutsARecordWhosePartsShareTheValues) {
  struct Machine {
    std::string record, gap, rig;
    std::map<std::string, double> truth;
  };
  for (const Machine& m : {Machine{"one_encoder/joint1",
                                   "$1 < 30 || $1 > 33",
                                   "ur5_joint",
                                   {{"inertia", 0.879872}, {"coulomb", 0.505244}}},
                           Machine{"undeclared/dev1",
                                   "$1 < 12 || $1 > 12.5",
                                   "two_inertia_servo",
                                   {{"backlash_angle", 5.741958e-4}, {"load_inertia", 85.03168}}}}) {
    const auto record = find_data(m.record + "/train.csv");
    if (!record) GTEST_SKIP() << m.record << " is not there";
    ASSERT_EQ(shell("awk -F, 'NR == 1 || " + m.gap + "' " + *record + " > a.csv && true").code, 0);
    done("identify a.csv --rig " + package_file("config/" + m.rig + ".yaml") + " --out f.yaml --json x.json");
    const Json found = json("x.json")["parameters"];
    for (const auto& [name, truth] : m.truth)
      EXPECT_NEAR(found[name]["value"].get<double>(), truth, 3 * found[name]["standard_error"].get<double>())
          << name;
    EXPECT_NE(json("x.json")["warnings"].dump().find("cut at 1 gap of more than"), std::string::npos);
  }
}

TEST_F(Cases, DeclaredGravityCounts) {
  SKIP_WITHOUT("identify_ignores_declared_gravity");
  const std::string folder = file("identify_ignores_declared_gravity");
  done("identify " + folder + "/record.csv --rig " + folder + "/rig.yaml --out f.yaml --json x.json");
  const Json p = json("x.json")["parameters"];
  for (const auto& [name, truth] : {std::pair{"inertia", 0.3}, {"coulomb", 1.0}, {"viscous", 1.0}})
    EXPECT_NEAR(p[name]["value"].get<double>(), truth, 2 * p[name]["standard_error"].get<double>()) << name;
  const Outcome fast = run("identify " + folder + "/fast_pendulum.csv --rig " + folder +
                           "/fast_pendulum.yaml --out f.yaml --json x.json");
  EXPECT_EQ(fast.err.find("in 0 %"), std::string::npos) << fast.err;
}

// A spring is no gap of nothing: forces do not jump, and the values of the one are not those of the other.
TEST_F(Cases, ASpringHasNoPlay) {
  SKIP_WITHOUT("series_elastic_identify");
  const std::string folder = file("series_elastic_identify");
  done("identify " + folder + "/record.csv --rig " + folder + "/rig.yaml --out f.yaml --json x.json");
  const Json p = json("x.json")["parameters"];
  const std::map<std::string, double> truth = {
      {"backlash_angle", 0}, {"encoder_skew", 0},  {"load_viscous", 9},      {"motor_viscous", 13},
      {"mesh_damping", 30},  {"load_coulomb", 15}, {"mesh_stiffness", 20e3}, {"load_inertia", 108}};
  for (const auto& [name, value] : truth)
    EXPECT_NEAR(p[name]["value"].get<double>(), value, 2.5 * p[name]["standard_error"].get<double>()) << name;
}

// Each controller stamps its own joints; the joints are those of one arm all the same.
TEST_F(Cases, ControllersThatBeginAtOtherTimesHaveOneClock) {
  SKIP_WITHOUT("arm_bag_second_controller_starts_later");
  const std::string folder = file("arm_bag_second_controller_starts_later");
  std::map<std::string, Json> found;
  for (const std::string name : {"together", "late", "no_velocity"}) {
    done("identify " + folder + "/" + name + ".bag --rig " + folder +
         "/ur5_arm.yaml --out f.yaml --json x.json");
    found[name] = json("x.json")["channels"];
  }
  for (const auto& [channel, together] : found["together"].items())
    for (const std::string name : {"late", "no_velocity"})
      EXPECT_NEAR(found[name][channel]["train"].get<double>() / together["train"].get<double>(), 1, 0.15)
          << name << " " << channel;  // of 53 s 1.5 s less; speeds of another low-pass
}

TEST_F(Cases, AXacroFileIsRefusedWithTheRemedy) {
  SKIP_WITHOUT("xacro_read_as_urdf");
  const Outcome outcome =
      run("simulate " + file("xacro_read_as_urdf/rig.yaml") + " --duration 2 --out x.csv");
  EXPECT_EQ(outcome.code, 65);
  expect_contains(outcome.err, "element xacro:macro");
  expect_contains(outcome.err, "rosrun xacro xacro");
}

TEST_F(Cases, WhatIsAnotherMachineFromTheFirstSampleIsSaid) {
  SKIP_WITHOUT("changed_from_the_first_sample");
  const std::string folder = file("changed_from_the_first_sample");
  const std::map<std::string, std::string> names = {{"healthy", ""},
                                                    {"torque_in_amperes", "motor_torque_gain"},
                                                    {"twice_the_play", "backlash"},
                                                    {"twice_the_friction", "motor_coulomb"}};
  for (const auto& [record, name] : names) {
    const Outcome outcome =
        run("detect_changes " + folder + "/" + record + ".csv --rig " + folder + "/rig.yaml --healthy " +
            folder + "/monday.csv " + folder + "/tuesday.csv --json x.json");
    EXPECT_EQ(outcome.code, name.empty() ? 0 : 3) << record << outcome.out << outcome.err;
    const Json different = json("x.json")["different_from_beginning"];
    EXPECT_EQ(different.empty(), name.empty()) << record;
    if (!name.empty())
      EXPECT_NE(std::find(different.begin(), different.end(), name), different.end()) << different;
  }
}

}  // namespace
}  // namespace backlash::test
