// SPDX-License-Identifier: BSD-3-Clause
// export_model as its users run it; what simulators make of the files is in test/report.
#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

class ExportModel : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    for (const char* rig : {"two_inertia_servo.yaml", "emps.yaml", "kr300.yaml", "sarkar_1997.yaml"})
      write(rig, content(package_file(std::string("config/") + rig)));
  }
};

TEST_F(ExportModel, WritesXmlForEachRigWithAJoint) {
  for (const char* rig : {"two_inertia_servo", "emps", "kr300"})
    for (const char* extension : {"mjcf", "urdf", "sdf"}) {
      const std::string out = std::string(rig) + "." + extension;
      done("export_model " + std::string(rig) + ".yaml --out " + out);
      // A parser of its own: expat, in Python.
      EXPECT_EQ(
          shell("/usr/bin/python3 -c 'import sys, xml.dom.minidom as x; x.parse(sys.argv[1])' " + out).code,
          0)
          << read(out);
    }
  expect_contains(read("kr300.mjcf"), "<mujoco model=\"kr300\">");
  expect_contains(read("kr300.urdf"), "<robot name=\"kr300\">");
  expect_contains(read("kr300.sdf"), "<model name=\"kr300\">");
}

TEST_F(ExportModel, SaysWhatTheFileDoesNotHold) {
  const Outcome outcome = run("export_model two_inertia_servo.yaml --out servo.urdf");
  EXPECT_EQ(outcome.code, 0);
  expect_contains(outcome.err,
                  "export_model: servo.urdf does not say: friction of the load against the frame: 15 N m");
  expect_contains(read("servo.urdf"), "<!-- Not said here: friction of the load against the frame: 15 N m");
  EXPECT_EQ(run("export_model two_inertia_servo.yaml --out servo.xml").err, "");
}

TEST_F(ExportModel, ArmsOwnMujocoFile) {
  for (const char* file : {"two_link_arm.yaml", "two_link_arm.urdf"})
    write(file, content(package_file(std::string("config/two_link_arm/") + file)));
  write("arm.xml",
        "<mujoco><worldbody><body name='upper'><joint name='shoulder' axis='0 -1 0'/><!-- mine -->"
        "<inertial pos='.1 0 0' mass='2' diaginertia='.01 .02 .02'/><body pos='.3 0 0'>"
        "<joint name='elbow' axis='0 -1 0' damping='0.1'/></body></body></worldbody></mujoco>");
  const Outcome outcome = run("export_model --mjcf arm.xml --rig two_link_arm.yaml --out identified.xml");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  expect_contains(outcome.err, "kept as in the file: upper: the rig file has no identified links");
  expect_contains(outcome.err, "does not say: elbow: play 0.003 rad");
  EXPECT_EQ(read("identified.xml"),
            "<mujoco><worldbody><body name='upper'><joint name='shoulder' axis='0 -1 0' damping=\"0.3\" "
            "frictionloss=\"0.4\" armature=\"0.12\"/><!-- mine --><inertial pos='.1 0 0' mass='2' "
            "diaginertia='.01 .02 .02'/><body pos='.3 0 0'><joint name='elbow' axis='0 -1 0' damping='0.1' "
            "frictionloss=\"0.15\" armature=\"0.03\"/></body></body></worldbody></mujoco>");
  EXPECT_EQ(run("export_model --mjcf arm.xml --rig two_link_arm.yaml --out identified.urdf").code, 64);
  EXPECT_EQ(
      run("export_model --mjcf arm.xml --urdf two_link_arm.urdf --rig two_link_arm.yaml --out i.xml").code,
      64);
  EXPECT_EQ(run("export_model --mjcf two_link_arm.urdf --rig two_link_arm.yaml --out i.xml").code, 65);
  EXPECT_EQ(run("export_model --mjcf none.xml --rig two_link_arm.yaml --out i.xml").code, 66);
}

TEST_F(ExportModel, ExitCodes) {
  EXPECT_EQ(run("export_model two_inertia_servo.yaml").code, 64);
  EXPECT_EQ(run("export_model two_inertia_servo.yaml --out servo.txt").code, 64);
  EXPECT_EQ(run("export_model two_inertia_servo.yaml --out servo.xml --torque 0").code, 64);
  EXPECT_EQ(run("export_model none.yaml --out servo.xml").code, 66);
  EXPECT_EQ(run("export_model two_inertia_servo.yaml --out none/servo.xml").code, 73);
  EXPECT_EQ(run("export_model --out servo.xml").code, 64);
  EXPECT_EQ(run("export_model --urdf robot.urdf --out new.urdf").code, 64);
  EXPECT_EQ(run("export_model --urdf robot.urdf --rig two_inertia_servo.yaml --out new.xml").code, 64);
  EXPECT_EQ(run("export_model --urdf robot.urdf --rig two_inertia_servo.yaml --out new.urdf").code, 65);
  const Outcome outcome = run("export_model sarkar_1997.yaml --out servo.xml");
  EXPECT_EQ(outcome.code, 65);
  expect_contains(outcome.err, "sarkar_1997.yaml: gear_train.link is locked");
  EXPECT_FALSE(exists("servo.xml"));
}

}  // namespace
}  // namespace backlash::test
