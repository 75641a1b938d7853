// SPDX-License-Identifier: BSD-3-Clause
// detect_changes as a user calls it, on records of a joint with known changes.
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

class DetectChanges : public CommandTest {
 protected:
  /// The second behind the first, 1 s later.
  std::string joined_records(const std::string& first, const std::string& second) const {
    std::istringstream before(read(first)), after(read(second));
    std::string line, text;
    double last = 0;
    while (std::getline(before, line)) {
      text += line + "\n";
      if (line[0] != 't') last = std::stod(line);
    }
    for (std::getline(after, line); std::getline(after, line);)
      text += std::to_string(std::stod(line) + last + 1) + line.substr(line.find(',')) + "\n";
    return text;
  }
};

TEST_F(DetectChanges, FindsEachChangeOfTheSharedRecordsAndNothingElse) {
  const auto truth_file = find_data("changes/truth.json");
  if (!truth_file) GTEST_SKIP() << "changes/truth.json is not there";
  std::ifstream in(*truth_file);
  const Json records = Json::parse(in)["records"];
  const std::map<std::string, std::string> names = {{"friction_up", "motor_coulomb"}, {"payload", "gravity"}};
  for (const auto& [name, truth] : records.items()) {
    const std::string record = *find_data("changes/" + name + ".csv");
    const Outcome outcome = run("detect_changes --rig " + package_file("config/ur10e_joint.yaml") +
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

TEST_F(DetectChanges, FindsSinceWhenAJointOfTwoInertiasHasMorePlay) {
  const std::string rig = package_file("config/simulated_robot/shoulder.yaml");
  const auto simulate = [&](const std::string& more) { return run("simulate " + rig + " " + more).code; };
  ASSERT_EQ(simulate("--duration 200 --seed 1 --out healthy.csv"), 0);
  ASSERT_EQ(simulate("--duration 90 --seed 2 --out before.csv"), 0);
  ASSERT_EQ(simulate("--duration 60 --seed 3 --backlash 7e-4 --out after.csv"), 0);
  write("record.csv", joined_records("before.csv", "after.csv"));
  const Outcome outcome =
      run("detect_changes --rig " + rig + " --healthy healthy.csv --json out.json record.csv");
  ASSERT_EQ(outcome.code, 2) << outcome.err;
  const Json report = Json::parse(read("out.json"));
  ASSERT_EQ(report["changes"].size(), 1u) << report["changes"];
  const Json& change = report["changes"][0];
  EXPECT_EQ(change["effect"], "backlash");
  EXPECT_LE(change["since_interval"][0], 91);
  EXPECT_GE(change["since_interval"][1], 90);
  const Json& angle = change["size"]["angle"];
  EXPECT_NEAR(angle["value"].get<double>(), 1.6e-4, 3 * angle["standard_error"].get<double>());
  EXPECT_GT(report["healthy_deflection_residual"], 0);
}

// Two tasks of a healthy joint, and the first of them again. What its model leaves where a move ends is at
// the same place in both, so that it is no fault.
TEST_F(DetectChanges, AHealthyTaskAgainDiffersByNothing) {
  const std::string rig = package_file("config/simulated_robot/shoulder.yaml");
  write("other.yaml",
        std::regex_replace(read(rig), std::regex("positions: .*"), "positions: [-0.5, 0.4, 0.1]"));
  done("simulate " + rig + " --duration 200 --seed 1 --out monday.csv");
  done("simulate other.yaml --duration 200 --seed 2 --out tuesday.csv");
  done("simulate " + rig + " --duration 200 --seed 11 --out today.csv");
  done("detect_changes --rig " + rig + " --healthy monday.csv tuesday.csv --json out.json today.csv");
  const Json report = Json::parse(read("out.json"));
  EXPECT_TRUE(report["changes"].empty()) << report["changes"];
  EXPECT_TRUE(report["different_from_beginning"].empty()) << report["different_from_beginning"];
}

// What the model of a joint without an encoder of its load leaves where teeth change their flank is several
// bumps beside one another, in a healthy record as well: each compared beside the others (a watched robot was
// warned of a `local_fault` after 20 minutes to hours).
TEST_F(DetectChanges, TheMotorsSideOfAHealthyJointDiffersByNothing) {
  const std::string rig = package_file("config/simulated_robot/elbow.yaml");
  for (const char* name : {"healthy", "today"}) {
    const std::string both = std::string(name) + "_both.csv";
    done("simulate " + rig + " --duration 200 --seed " + (name[0] == 'h' ? "1" : "2") + " --out " + both);
    // time, motor_torque, motor_position, and not motor_velocity, load_position, load_velocity
    write(std::string(name) + ".csv", std::regex_replace(read(both), std::regex("(,[^,\n]*){3}(?=\n)"), ""));
  }
  done("detect_changes --rig " + rig + " --healthy healthy.csv --json out.json today.csv");
  const Json report = Json::parse(read("out.json"));
  EXPECT_EQ(report["windows"], 49);
  EXPECT_TRUE(report["changes"].empty()) << report["changes"];
  EXPECT_TRUE(report["different_from_beginning"].empty()) << report["different_from_beginning"];
}

// The forearm of an arm takes up half a kilogram while the gears of its elbow are found to have 5 % more
// play.
TEST_F(DetectChanges, FindsWhichJointOfAnArmHasMorePlayAndWhatItCarries) {
  const std::string folder = package_file("config/two_link_arm/"), rig = folder + "two_link_arm.yaml";
  write("two_link_arm.urdf", content(folder + "two_link_arm.urdf"));
  std::string text = content(rig);
  const std::string old = "backlash_angle: 3.0e-3";
  ASSERT_NE(text.find(old), std::string::npos);
  text.replace(text.find(old), old.size(), "backlash_angle: 3.15e-3");
  write("changed.yaml", text +
                            "\npayloads:\n  - {link: forearm, mass: 0.5, centre: [0.2, 0, 0], "
                            "inertia: [1e-3, 0, 0, 1e-3, 0, 1e-3]}\n");
  done("simulate " + rig + " --sample-rate 200 --duration 60 --seed 1 --out healthy.csv");
  done("simulate " + rig + " --sample-rate 200 --duration 30 --seed 2 --out before.csv");
  done("simulate changed.yaml --sample-rate 200 --duration 30 --seed 3 --out after.csv");
  write("record.csv", joined_records("before.csv", "after.csv"));
  const Outcome outcome =
      run("detect_changes --rig " + rig + " --healthy healthy.csv --json out.json record.csv");
  ASSERT_EQ(outcome.code, 2) << outcome.out << outcome.err;
  const Json changes = Json::parse(read("out.json"))["changes"];
  ASSERT_EQ(changes.size(), 2u) << changes;
  for (const Json& change : changes) {
    const bool play = change["effect"] == "backlash";
    EXPECT_EQ(change["effect"], play ? "backlash" : "payload");
    EXPECT_EQ(change["joint"], "elbow");
    EXPECT_EQ(change.contains("link"), !play);
    EXPECT_LE(change["since_interval"][0], 31);
    EXPECT_GE(change["since_interval"][1], 30);
    const Json& size = change["size"][play ? "angle" : "mass"];
    EXPECT_NEAR(size["value"].get<double>(), play ? 1.5e-4 : 0.5, 3 * size["standard_error"].get<double>());
  }
}

// By eye the push begins at 1.84 s on the first joint; nothing before.
TEST_F(DetectChanges, FindsAPushOnAMeasuredArmThatHoldsItsPose) {
  const auto push = find_data("measured/ur5_arm_push.csv"), healthy = find_data("measured/ur5_arm_b.csv");
  if (!push || !healthy) GTEST_SKIP() << "measured/ur5_arm_push.csv is not there";
  const Outcome outcome = run("detect_changes --rig " + package_file("config/ur10e_arm/ur10e_arm.yaml") +
                              " --healthy " + *healthy + " --json out.json " + *push);
  ASSERT_EQ(outcome.code, 2) << outcome.err;
  const Json first = Json::parse(read("out.json"))["changes"][0];
  EXPECT_EQ(first["effect"], "external_torque");
  EXPECT_EQ(first["joint"], "shoulder_pan_joint");
  EXPECT_NEAR(first["since"].get<double>(), 1.84, 0.1);
  EXPECT_LE(first["since_interval"][0], 1.84);
  EXPECT_GE(first["since_interval"][1], 1.84);
  EXPECT_FALSE(first["until"].is_null());
}

// Learned from one short record, in another task: what the model of a real arm lacks is no change.
TEST_F(DetectChanges, HealthyTasksOfAMeasuredArmAreNoChangesOfEachOther) {
  const std::string rig = package_file("config/ur10e_arm/ur10e_arm.yaml");
  for (const auto& [learned, looked_at] :
       {std::pair("a", "b"), std::pair("b", "a"), std::pair("a", "free"), std::pair("free", "b")}) {
    const auto healthy = find_data("measured/ur5_arm_" + std::string(learned) + ".csv");
    const auto record = find_data("measured/ur5_arm_" + std::string(looked_at) + ".csv");
    if (!healthy || !record) GTEST_SKIP() << "measured/ur5_arm_" << learned << ".csv is not there";
    const Outcome outcome =
        run("detect_changes --rig " + rig + " --healthy " + *healthy + " --json out.json " + *record);
    EXPECT_NE(outcome.code, 2) << learned << ", " << looked_at << ": " << outcome.out;
    EXPECT_EQ(Json::parse(read("out.json"))["changes"].size(), 0U);
  }
}

TEST_F(DetectChanges, AnotherTaskIsNoChangeAndWhatFollowsNoEffectIsNoHealth) {
  const std::string rig = package_file("config/simulated_robot/shoulder.yaml");
  std::ifstream in(rig);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  for (const auto& [old, other] :
       {std::pair<std::string, std::string>{"[0.6, -0.3, 0.2]", "[0.2, -0.1, 0.1]"},
        {"dwell: 0.4", "dwell: 0.05"}}) {
    ASSERT_NE(text.find(old), std::string::npos);
    text.replace(text.find(old), old.size(), other);
  }
  write("short_moves.yaml", text);
  ASSERT_EQ(run("simulate " + rig + " --duration 200 --seed 1 --out healthy.csv").code, 0);
  ASSERT_EQ(run("simulate " + rig + " --duration 60 --seed 2 --out long.csv").code, 0);
  ASSERT_EQ(run("simulate short_moves.yaml --duration 60 --seed 3 --out short.csv").code, 0);
  const auto detect = [&] {
    return run("detect_changes --rig " + rig + " --healthy healthy.csv --json out.json record.csv");
  };
  write("record.csv", joined_records("long.csv", "short.csv"));
  const Outcome healthy = detect();
  EXPECT_EQ(healthy.code, 0) << healthy.out << healthy.err;
  EXPECT_TRUE(Json::parse(read("out.json"))["cannot_tell"].is_null());
  // The motor's torque swings by 10 N m all the time.
  std::istringstream lines(read("long.csv"));
  std::string line, swings;
  std::getline(lines, line);
  swings = line + "\n";
  ASSERT_EQ(line.rfind("time,motor_torque,", 0), 0u) << line;
  while (std::getline(lines, line)) {
    const std::size_t first = line.find(','), second = line.find(',', first + 1);
    const double torque = std::stod(line.substr(first + 1)) + 10 * std::sin(3 * std::stod(line));
    swings += line.substr(0, first + 1) + std::to_string(torque) + line.substr(second) + "\n";
  }
  write("record.csv", swings);
  const Outcome outcome = detect();
  EXPECT_EQ(outcome.code, 3) << outcome.out;
  expect_contains(outcome.out, "cannot tell: from its beginning");
  expect_contains(outcome.err, "from its beginning the record follows no effect");
  const Json json = Json::parse(read("out.json"));
  EXPECT_TRUE(json["changes"].empty());
  expect_contains(json["cannot_tell"].get<std::string>(), "from its beginning");
}

TEST_F(DetectChanges, RefusesOtherGearTrains) {
  write("record.csv", "time,motor_torque,motor_position\n0,0,0\n0.1,0,0\n0.2,0,0\n");
  const Outcome outcome = run("detect_changes --rig " + package_file("config/cycloidal.yaml") +
                              " --healthy record.csv --json out.json record.csv");
  EXPECT_EQ(outcome.code, 3);
  expect_contains(outcome.err, "has no torque sensor before the gear");
  const Json json = Json::parse(read("out.json"));
  EXPECT_TRUE(json["changes"].empty());
  EXPECT_EQ(json["windows"], 0);
  EXPECT_TRUE(json["threshold"].is_null());
  EXPECT_TRUE(json["healthy_residual"].is_null());
  expect_contains(json["cannot_tell"].get<std::string>(), "has no torque sensor before the gear");
}

}  // namespace
}  // namespace backlash::test
