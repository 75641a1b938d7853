// SPDX-License-Identifier: BSD-3-Clause
// plan_motion and simulate --motion as their users run them.
#include <nlohmann/json.hpp>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

class PlanMotion : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::filesystem::create_directory_symlink(package_file("config/two_link_arm"), path("rig"));
    write("link.urdf", R"(<robot name="one"><link name="base"/><link name="arm"><inertial>
      <origin xyz="0.25 0 0"/><mass value="2"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
      <joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 -1 0"/>
      <limit lower="-3" upper="3" effort="60" velocity="3"/></joint></robot>)");
    hinge("hinge.yaml", "{acceleration: 5}");
  }
  /// An arm of one joint, which is planned at once.
  void hinge(const std::string& name, const std::string& limits) const {
    write(name,
          "schema_version: 1\nname: one\nurdf: link.urdf\ngravity: [0, 0, -9.80665]\n"
          "drives: {channel: motor_torque, terms: [rotor_inertia, coulomb]}\n"
          "joints:\n  - {name: hinge, rotor_inertia: 0.1, coulomb: 0.2, motion_limits: " +
              limits +
              "}\nidentification: {kinematics_cutoff: 20, torque_cutoff: 10, slowest: 0.02, friction_speed: "
              "0.02}\n");
  }
  void refused(const std::string& line, int code, const std::string& words) const {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, code) << line;
    expect_contains(outcome.err, words);
  }
};

TEST_F(PlanMotion, AnArmThatFollowsItShowsWhatItsOwnMotionHides) {
  const std::string rig = "rig/two_link_arm_hidden.yaml";
  done("simulate " + rig + " --duration 30 --out ordinary.csv");
  EXPECT_EQ(run("diagnose_record ordinary.csv --rig " + rig + " --json ordinary.json").code, 3);
  const Outcome plan =
      done("plan_motion " + rig + " --out motion.yaml --json plan.json --csv way.csv --rate 100");
  expect_contains(plan.out, "shoulder: ");
  expect_contains(plan.out, "gap shown: ");
  const auto json = nlohmann::ordered_json::parse(read("plan.json"));
  EXPECT_GT(json.at("information").at("gain"), 1);
  EXPECT_LT(json.at("information").at("condition"), json.at("information").at("reference_condition"));
  for (const auto& [name, joint] : json.at("joints").items()) {
    EXPECT_EQ(joint.at("gap").at("status"), "shown") << name;
    EXPECT_FALSE(joint.at("gap").at("hidden").empty()) << name;
  }
  expect_contains(read("way.csv"), "time,shoulder/reference_position,");
  done("simulate " + rig + " --motion motion.yaml --duration 30 --out planned.csv");
  done("diagnose_record planned.csv --rig " + rig + " --json planned.json");
  const auto joints = nlohmann::ordered_json::parse(read("planned.json")).at("joints");
  const double truth[] = {2e-3, 3e-3};  // the rig file's
  int j = 0;
  for (const auto& [name, joint] : joints.items()) {
    const auto& interval = joint.at("verdict").at("angle_interval");
    EXPECT_LE(interval.at(0).get<double>(), truth[j]) << name;
    EXPECT_GE(interval.at(1).get<double>(), truth[j]) << name;
    EXPECT_LT(interval.at(1).get<double>() - interval.at(0).get<double>(), 0.2 * truth[j]) << name;
    ++j;
  }
}

TEST_F(PlanMotion, AGapThatGravityHidesIsReportedAndTheRestIsWritten) {
  hinge("held.yaml", "{lower: -0.5, upper: 0.5, acceleration: 2}");
  const Outcome outcome = run("plan_motion held.yaml --out motion.yaml");
  EXPECT_EQ(outcome.code, 3);
  expect_contains(outcome.out, "cannot be shown within the limits");
  expect_contains(outcome.out, "gravity holds it from -0.50 to 0.50 rad on the positive flank");
  expect_contains(read("motion.yaml"), "gap: impossible");
}

TEST_F(PlanMotion, TheSeedDecides) {
  done("plan_motion hinge.yaml --out a.yaml");
  done("plan_motion hinge.yaml --out b.yaml --seed 1");
  done("plan_motion hinge.yaml --out c.yaml --seed 2");
  EXPECT_EQ(read("a.yaml"), read("b.yaml"));
  EXPECT_NE(read("a.yaml"), read("c.yaml"));
}

TEST_F(PlanMotion, AUrdfIsPlannedAndGivesARigFile) {
  const std::string line = "plan_motion link.urdf --acceleration 5 ";
  const Outcome outcome = done(line + "--out of_urdf.yaml --write-rig rig.yaml");
  expect_contains(outcome.out, "the rig file states neither its rotor nor its friction");
  done("plan_motion rig.yaml --acceleration 5 --out of_rig.yaml");
  const auto motion = [this](const std::string& name) {
    const std::string text = read(name);
    return text.substr(text.find("joints:"));
  };
  EXPECT_EQ(motion("of_urdf.yaml"), motion("of_rig.yaml"));
  write("r.csv", "time,hinge/motor_torque,hinge/motor_position\n0,0,0\n");
  refused("plan_motion link.urdf --out m.yaml", 65, "no limit of the acceleration");
  refused("plan_motion hinge.yaml --out m.yaml --write-rig r.yaml", 64, "--write-rig");
  refused("identify r.csv --rig link.urdf --out f.yaml --json f.json", 65, "is a URDF");
}

TEST_F(PlanMotion, JointsOfAUrdfCanBeHeld) {
  std::string text = read("link.urdf");
  text.insert(text.find("</robot>"), R"(<link name="finger"><inertial><mass value="0.1"/>
      <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link>
      <link name="wheel"/><joint name="roll" type="continuous"><parent link="base"/><child link="wheel"/></joint>
      <joint name="slide" type="prismatic"><parent link="arm"/><child link="finger"/><axis xyz="1 0 0"/>
      <limit lower="0" upper="1" effort="1" velocity="1"/></joint>)");
  write("gripper.urdf", text);
  const std::string line = "plan_motion gripper.urdf --acceleration 5 --out m.yaml";
  refused(line, 65, "begin at the same body");
  refused(line + " --hold roll=x", 64, "--hold 'roll=x'");
  refused(line + " --hold roll roll=1", 64, "'roll' twice");
  refused(line + " --hold rol slide=0.2", 65, "no joint 'rol'");
  refused("plan_motion hinge.yaml --out m.yaml --hold slide", 64, "--hold is for a URDF");
  done(line + " --hold roll slide=0.2 --write-rig rig.yaml");
  expect_contains(read("rig.yaml"), "\"slide\": 0.2");
  done("plan_motion rig.yaml --acceleration 5 --out of_rig.yaml");
}

TEST_F(PlanMotion, WhatDoesNotServeIsRefused) {
  const std::string joint = package_file("config/two_inertia_servo.yaml");
  refused("plan_motion hinge.yaml", 64, "--out");
  refused("plan_motion hinge.yaml --out m.yaml --harmonics 1", 64, "--harmonics");
  refused("plan_motion hinge.yaml --out m.yaml --csv way.csv", 64, "--rate");
  refused("plan_motion hinge.yaml --out hinge.yaml", 64, "hinge.yaml");
  refused("plan_motion hinge.yaml --out m.yaml --json m.yaml", 64, "--json");
  refused("plan_motion " + joint + " --out m.yaml", 65, "the rig of one joint");
  hinge("bad.yaml", "{lower: -1}");
  refused("plan_motion bad.yaml --out m.yaml", 65,
          "bad.yaml:7: joints[0].name = hinge: no limit of the acceleration");
  refused("plan_motion none.yaml --out m.yaml", 66, "none.yaml");
  refused("plan_motion hinge.yaml --out none/m.yaml", 73, "none");
  done("plan_motion bad.yaml --acceleration 4 --out m.yaml");
}

TEST_F(PlanMotion, ASimulationTakesOnlyAMotionOfItsJoints) {
  done("plan_motion hinge.yaml --out motion.yaml");
  const std::string rig = "rig/two_link_arm.yaml";
  refused("simulate " + rig + " --motion motion.yaml --duration 1 --out r.csv", 65,
          "motion.yaml: joints hinge: the arm 'two_link_arm' has shoulder, elbow");
  refused("simulate " + rig + " --motion none.yaml --duration 1 --out r.csv", 66, "none.yaml");
  refused("simulate " + package_file("config/two_inertia_servo.yaml") +
              " --motion motion.yaml --duration 1 --out r.csv",
          64, "--motion");
  std::string text = read("motion.yaml");
  text.replace(text.find("sines: ["), 8, "sines: [0.5, ");
  write("jumps.yaml", text);
  refused("simulate " + rig + " --motion jumps.yaml --duration 1 --out r.csv", 65, "excitation.sines");
}

}  // namespace
}  // namespace backlash::test
