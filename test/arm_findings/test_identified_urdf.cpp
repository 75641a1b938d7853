// SPDX-License-Identifier: BSD-3-Clause
// Oracles: MuJoCo, which reads the written URDF by itself and must need the torques of the identified chain;
// urdfdom; and the text, of which nothing else may change.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/arm_findings/identified_urdf.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "support/data.h"
#ifdef BACKLASH_DIAGNOSIS_MUJOCO
#include <mujoco/mujoco.h>
#endif

namespace backlash::arm_findings {
namespace {

const char* const kRobot = R"(<?xml version='1.0'?>
<!-- a comment with a > and a <tag> -->
<robot name="two">
  <link name="base"/>
  <link name="upper" ><!-- kept -->
    <inertial>
      <!-- from CAD -->
      <origin rpy="0 0 0.5"  xyz = "0.1 0 0"/>
      <mass value='2.0' />
      <inertia iyy="0.02" ixx="0.01" izz="0.025" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <visual><geometry><box size="1 1 1"/></geometry></visual>
  </link>
  <link name="lower"/>
  <link name="tool"><inertial><mass value="0.5"/><inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous">
    <parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <dynamics friction="9"/>   <!-- guessed -->
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
  </joint>
  <joint name="flange" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0.3 0 0"/></joint>
</robot>
)";

const char* const kRig = R"(schema_version: 1
name: two
urdf: two.urdf
gravity: [0, 0, -9.80665]
drives: {channel: motor_torque, terms: [coulomb, viscous, offset]}
identification: {kinematics_cutoff: 10, torque_cutoff: 5, slowest: 0.02, friction_speed: 0.01}
joints:
  - {name: shoulder, coulomb: 1.5, viscous: 0.25, offset: 0.1, training_error: 0.01}
  - {name: elbow, coulomb: 0.5, viscous: 0.125, training_error: 0.01, gear: {backlash_angle: 0.002, contact: {law: linear, stiffness: 1000, damping: 1}}}
links:
  - {link: upper, mass: 3, centre: [0.15, 0.01, 0.02], inertia: [0.02, 0.001, 0.002, 0.05, 0, 0.06], not_shown: [mass]}
  - {link: lower, mass: 1.5, centre: [0.2, 0, 0.01], inertia: [0.004, 0, 0, 0.03, 0, 0.03]}
)";

class IdentifiedUrdfFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_.path("two.urdf")) << kRobot;
    arm_ = geared_arm::geared_arm_from_text(
        kRig, "two.yaml", std::filesystem::path(folder_.path("two.urdf")).parent_path().string());
  }
  ScratchFolder folder_;
  geared_arm::GearedArm arm_;
};

TEST_F(IdentifiedUrdfFile, HasTheIdentifiedChainAndNothingElseIsTouched) {
  const IdentifiedUrdf out = identified_urdf(kRobot, "two.urdf", arm_);
  const arm::Chain chain = arm::chain_of_urdf(out.text, "out.urdf", arm_.rig.joint_names());
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_LT((chain.links[i] - arm_.rig.chain.links[i]).norm(), 1e-7) << i;  // printed with 8 digits
  for (const char* kept :
       {"<!-- a comment with a > and a <tag> -->", "<link name=\"upper\" ><!-- kept -->", "<!-- from CAD -->",
        "rpy=\"0 0 0.5\"  xyz = \"0.15 0.01 0.02\"", "<mass value='3' />",
        "<visual><geometry><box size=\"1 1 1\"/></geometry></visual>",
        "friction=\"1.5\" damping=\"0.25\"/>   <!-- guessed -->",
        "<link name=\"tool\"><inertial><mass value=\"0.5\"/>",
        "<dynamics damping=\"0.125\" friction=\"0.5\"/>", "<!-- play: 0.002 rad, wall to wall -->"})
    EXPECT_NE(out.text.find(kept), std::string::npos) << kept << "\n" << out.text;
  ASSERT_EQ(out.kept.size(), 1u);
  EXPECT_EQ(out.kept[0], "upper: mass: no motion shows it");
  ASSERT_EQ(out.unsaid.size(), 1u);
  EXPECT_EQ(out.unsaid[0], "shoulder: offset 0.1 N m");
  // Written again it is the same.
  EXPECT_EQ(identified_urdf(out.text, "two.urdf", arm_).text.find("damping=\"0.25\" damping"),
            std::string::npos);
}

TEST_F(IdentifiedUrdfFile, WhatIsNotIdentifiedKeepsItsText) {
  arm_.rig.fitted = false;
  for (arm::JointDrive& drive : arm_.rig.joints) drive.training_error = 0;
  arm_.joints[1].gear.reset();
  arm_.rig.terms.clear();
  const IdentifiedUrdf out = identified_urdf(kRobot, "two.urdf", arm_);
  EXPECT_EQ(out.text, kRobot);
  EXPECT_EQ(out.kept.size(), 2u);
}

TEST_F(IdentifiedUrdfFile, AnotherRobotAndNoXmlAreRefused) {
  const std::string longer = std::regex_replace(std::string(kRobot), std::regex("0.4 0 0"), "0.5 0 0");
  EXPECT_THROW(identified_urdf(longer, "x.urdf", arm_), BadData);
  EXPECT_THROW(identified_urdf("<robot>", "x.urdf", arm_), BadData);
}

TEST_F(IdentifiedUrdfFile, ABodyThatIsLighterThanWhatIsFixedToItKeepsItsValues) {
  arm_.rig.chain.links[1] *= 0.2;
  const IdentifiedUrdf out = identified_urdf(kRobot, "two.urdf", arm_);
  EXPECT_NE(out.text.find("<link name=\"lower\"/>"), std::string::npos);
  EXPECT_NE(out.kept.back().find("lower: what is fixed to it weighs 0.5 kg"), std::string::npos)
      << out.kept.back();
}

#ifdef BACKLASH_DIAGNOSIS_MUJOCO
TEST_F(IdentifiedUrdfFile, MujocoNeedsTheSameTorques) {
  const std::string path = folder_.path("out.urdf");
  std::string text = identified_urdf(kRobot, "two.urdf", arm_).text;
  // MuJoCo's URDF: bodies that are fixed stay bodies, and no plane of symmetry is made of an inertia.
  text.insert(text.find("<link"),
              "<mujoco><compiler fusestatic=\"false\" balanceinertia=\"false\"/></mujoco>");
  std::ofstream(path) << text;
  char error[500] = "";
  mjModel* model = mj_loadXML(path.c_str(), nullptr, error, sizeof error);
  ASSERT_NE(model, nullptr) << error;
  model->opt.gravity[2] = -9.80665;
  model->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_PASSIVE | mjDSBL_CONTACT;
  mjData* data = mj_makeData(model);
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    arm::Joints q(2), v(2), a(2);
    for (Eigen::Index j = 0; j < 2; ++j) {
      q[j] = data->qpos[j] = random.uniform(-3, 3);
      v[j] = data->qvel[j] = random.uniform(-2, 2);
      a[j] = data->qacc[j] = random.uniform(-5, 5);
    }
    mj_inverse(model, data);
    const arm::Joints torque = arm::inverse_dynamics(arm_.rig.chain, q, v, a);
    for (Eigen::Index j = 0; j < 2; ++j)
      EXPECT_NEAR(data->qfrc_inverse[j], torque[j], 1e-5) << i << " " << j;  // printed with 8 digits
  }
  mj_deleteData(data);
  mj_deleteModel(model);
}
#endif

}  // namespace
}  // namespace backlash::arm_findings
