// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "support/data.h"

namespace backlash::arm {
namespace {

std::string text_of(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string with(std::string text, const std::string& what, const std::string& by) {
  const auto place = text.find(what);
  EXPECT_NE(place, std::string::npos) << what;
  return text.replace(place, what.size(), by);
}

class ArmRigFile : public ::testing::Test {
 protected:
  ArmRigFile() {
    for (const char* name : {"ur10e_arm.yaml", "ur10e_arm.urdf"})
      std::filesystem::copy(test::package_file(std::string("config/ur10e_arm/") + name), path(name));
  }
  std::string path(const std::string& name) const { return folder_.path(name); }
  std::string refusal(const std::string& rig) const {
    write_file(path("x.yaml"), rig);
    try {
      load_arm_rig(path("x.yaml"));
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  }
  ScratchFolder folder_;
  const std::string rig_ = text_of(test::package_file("config/ur10e_arm/ur10e_arm.yaml"));
  const std::string urdf_ = text_of(test::package_file("config/ur10e_arm/ur10e_arm.urdf"));
};

TEST_F(ArmRigFile, IsReadWithItsRobot) {
  const ArmRig rig = load_arm_rig(path("ur10e_arm.yaml"));
  ASSERT_EQ(rig.chain.size(), 6u);
  EXPECT_EQ(rig.chain.joints[2].position, Eigen::Vector3d(-0.6127, 0, 0));
  EXPECT_EQ(rig.joints[5].constant, 10.12);
  EXPECT_EQ(rig.joints[5].constant_error, 0.1);
  EXPECT_EQ(rig.common_error, 0.15);
  EXPECT_FALSE(rig.fitted);
}

TEST_F(ArmRigFile, IsWrittenAsItIsRead) {
  ArmRig rig = load_arm_rig(path("ur10e_arm.yaml"));
  rig.fitted = true;
  rig.joints[3].terms[1] = 2.5;
  rig.joints[3].terms[6] = 0.04, rig.joints[3].load_error = 0.01;
  rig.common_error = 0.035;
  rig.shown.assign(60, Shown::leads);
  rig.shown[0] = Shown::not_at_all, rig.shown[19] = Shown::in_others;
  rig.payloads.push_back({"wrist_3_link", -1, rig.chain.links[5]});
  write_file(path("y.yaml"), arm_rig_text(rig, {"a comment"}));
  const ArmRig back = load_arm_rig(path("y.yaml"));
  EXPECT_TRUE(back.fitted);
  EXPECT_EQ(back.joints[3].terms, rig.joints[3].terms);
  EXPECT_EQ(back.joints[3].load_error, 0.01);
  EXPECT_EQ(back.common_error, 0.035);
  EXPECT_EQ(back.shown, rig.shown);
  ASSERT_EQ(back.payloads.size(), 1u);
  EXPECT_EQ(back.payloads[0].sign, -1);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_LT((back.chain.links[i] - rig.chain.links[i]).norm(), 1e-6);
  EXPECT_LT(loaded_chain(back).links[5].norm(), 1e-6);
}

TEST_F(ArmRigFile, WrongFilesAreRefusedWithTheirPlace) {
  EXPECT_NE(refusal(with(rig_, "ur10e_arm.urdf              #", "none.urdf #")).find("none.urdf"),
            std::string::npos);
  EXPECT_NE(refusal(with(rig_, "elbow_joint", "elbow")).find("no joint 'elbow'; there are: elbow_joint"),
            std::string::npos);
  EXPECT_NE(refusal(with(rig_, "gravity: [0, 0, -9.80665]", "gravity: [0, -9.8]")).find("gravity"),
            std::string::npos);
  EXPECT_NE(refusal(with(rig_, "value: 10.0,", "value: -10.0,")).find("torque_constant"), std::string::npos);
  EXPECT_NE(refusal(with(rig_, "coulomb,", "coulomp,")).find("coulomp"), std::string::npos);
  EXPECT_NE(refusal(with(rig_, "torque_cutoff", "torque_cut")).find("torque_cut"), std::string::npos);
  EXPECT_NE(refusal(with(rig_, "motor_current ", "motor_position ")).find("channel"), std::string::npos);
  EXPECT_NE(refusal(with(rig_, "  - name: wrist_3_joint", "  - name: wrist_2_joint")).find("there twice"),
            std::string::npos);
}

TEST_F(ArmRigFile, WrongEffectsOfAJointAreRefused) {
  const auto outcome = [&](const std::string& effect) {
    return refusal(
        with(rig_, "  - name: wrist_3_joint", "  - name: wrist_3_joint\n    effects: [{" + effect + "}]"));
  };
  EXPECT_EQ(outcome("id: stribeck, torque: 1, speed: 0.1"), "accepted");
  EXPECT_NE(outcome("id: stribek, torque: 1, speed: 0.1").find("stribek"), std::string::npos);
  EXPECT_NE(outcome("id: stribeck, torque: -1, speed: 0.1").find("torque"), std::string::npos);
  EXPECT_NE(outcome("id: stribeck, torque: 1, speed: 0").find("speed"), std::string::npos);
  EXPECT_NE(outcome("id: stribeck, torque: 1, speed: 0.1, sped: 1").find("sped"), std::string::npos);
  EXPECT_EQ(outcome("id: motor_torque_gain, gain: -0.2"), "accepted");
  EXPECT_NE(outcome("id: motor_torque_gain, gain: -1").find("gain"),
            std::string::npos);  // a motor without torque
  EXPECT_NE(outcome("id: cogging, amplitude: 1, order: 3").find("phase"), std::string::npos);
  for (const char* joint : {"wrist_3_joint", "wrist_9_joint"})
    EXPECT_NE(outcome(std::string("id: transmission_coupling, ratio: 0.1, joint: ") + joint).find(joint),
              std::string::npos);
}

TEST_F(ArmRigFile, WrongRobotsAreRefused) {
  const std::vector<std::string> joints = load_arm_rig(path("ur10e_arm.yaml")).joint_names();
  const auto outcome = [&](const std::string& text, std::vector<std::string> names) {
    try {
      chain_of_urdf(text, "x.urdf", names);
    } catch (const BadData& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(outcome(urdf_, joints), "accepted");
  EXPECT_NE(outcome("nonsense", joints).find("cannot be read as a URDF"), std::string::npos);
  EXPECT_NE(outcome(urdf_, {"elbow_joint", "shoulder_lift_joint"}).find("not the next of one chain"),
            std::string::npos);
  EXPECT_NE(outcome(urdf_, {"shoulder_pan_joint", "elbow_joint"}).find("moves and is not one of the rig's"),
            std::string::npos);
  EXPECT_NE(outcome(urdf_, {"tool0_joint"}).find("neither revolute nor continuous"), std::string::npos);
  EXPECT_NE(outcome(with(urdf_, "name=\"elbow_joint\" type=\"revolute\"",
                         "name=\"elbow_joint\" type=\"prismatic\""),
                    joints)
                .find("neither revolute nor continuous"),
            std::string::npos);
}

// A tool in a macro would be left out, and gravity with it.
TEST_F(ArmRigFile, AXacroFileIsNoUrdf) {
  const std::string macro =
      with(urdf_, "<link name=\"base_link\"", "<xacro:tool parent=\"x\"/>\n  <link name=\"base_link\"");
  write_file(path("ur10e_arm.urdf"), macro);
  const std::string said = refusal(rig_);
  EXPECT_NE(said.find("ur10e_arm.urdf"), std::string::npos) << said;
  EXPECT_NE(said.find("element xacro:tool"), std::string::npos) << said;
  EXPECT_NE(said.find("rosrun xacro xacro"), std::string::npos) << said;
  // What xacro has written names it in a comment.
  write_file(path("ur10e_arm.urdf"),
             with(urdf_, "<link name=\"base_link\"", "<!-- by <xacro:tool/> --><link name=\"base_link\""));
  EXPECT_EQ(refusal(rig_), "accepted");
}

TEST_F(ArmRigFile, AUrdfByItselfIsAllItsJointsThatMove) {
  const std::string urdf = path("ur10e_arm.urdf");
  const ArmRig declared = load_arm_rig(path("ur10e_arm.yaml"));
  const ArmRig rig = arm_rig_of_urdf(urdf);
  EXPECT_EQ(rig.joint_names(), declared.joint_names());  // tool0_joint is fixed
  write_file(path("of_urdf.yaml"), rig.text);
  const ArmRig back = load_arm_rig(path("of_urdf.yaml"));
  EXPECT_EQ(back.chain.links[2], declared.chain.links[2]);
  EXPECT_EQ(back.chain.gravity, declared.chain.gravity);
  EXPECT_EQ(back.joints[0].terms, JointDrive().terms);

  write_file(path("two.urdf"), R"(<robot name="two"><link name="a"/><link name="b"/><link name="c"/>
    <joint name="left" type="continuous"><parent link="a"/><child link="b"/></joint>
    <joint name="right" type="continuous"><parent link="a"/><child link="c"/></joint></robot>)");
  try {
    arm_rig_of_urdf(path("two.urdf"));
    ADD_FAILURE() << "accepted";
  } catch (const BadData& error) {
    EXPECT_NE(std::string(error.what()).find("'left' and 'right' begin at the same body"), std::string::npos);
  }
}

// A point of 2 kg and a gripper whose fingers mimic each other: where they stand their masses are points, so
// that the body is known in closed form. Left moves along y and by mimicry right against it; the wrist
// between arm and gripper turns by 90 degrees about z, so that y of the gripper is -x of the arm.
TEST_F(ArmRigFile, JointsThatAreHeldBelongToTheLinkThatCarriesThem) {
  const std::string point = R"(<inertial><mass value="M"/><inertia ixx="1e-9" ixy="0" ixz="0" iyy="1e-9"
    iyz="0" izz="1e-9"/></inertial></link>)";
  const auto link = [&](const std::string& name, const std::string& mass) {
    return "<link name=\"" + name + "\">" + with(point, "M", mass);
  };
  const std::string urdf = R"(<robot name="gripper"><link name="base"/>)" + link("arm", "2") +
                           link("palm", "1") + link("a", "0.5") + link("b", "0.25") +
                           R"(<joint name="hinge" type="continuous"><parent link="base"/>
    <child link="arm"/><axis xyz="0 -1 0"/></joint><joint name="wrist" type="revolute"><parent link="arm"/>
    <child link="palm"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1"
    velocity="1"/></joint><joint name="left" type="prismatic"><parent link="palm"/><child link="a"/>
    <origin xyz="0 0.1 0"/><axis xyz="0 1 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
    <joint name="right" type="prismatic"><parent link="palm"/><child link="b"/><origin xyz="0 -0.1 0"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
    <mimic joint="left" multiplier="-1" offset="-0.01"/></joint></robot>)";
  write_file(path("gripper.urdf"), urdf);
  const HeldJoints held = {{"wrist", M_PI / 2}, {"left", 0.03}};
  const ArmRig rig = arm_rig_of_urdf(path("gripper.urdf"), held);
  ASSERT_EQ(rig.joint_names(), std::vector<std::string>{"hinge"});
  const Body body = body_of(rig.chain.links[0]);
  EXPECT_NEAR(body.mass, 3.75, 1e-12);
  EXPECT_NEAR(body.centre.x(), (1.0 + 0.5 * (1 - 0.13) + 0.25 * (1 + 0.14)) / 3.75, 1e-12);
  EXPECT_NEAR(body.centre.y(), 0, 1e-12);
  // about the origin, m x^2 of each point about y; 1e-9 are those of the bodies
  EXPECT_NEAR(rig.chain.links[0][7], 1 + 0.5 * 0.87 * 0.87 + 0.25 * 1.14 * 1.14, 1e-8);
  write_file(path("gripper.yaml"), rig.text);
  EXPECT_EQ(load_arm_rig(path("gripper.yaml")).chain.links, rig.chain.links);

  // A held joint before the first one turns that one's frame.
  const Chain wrist = read_chain(path("gripper.urdf"), {"wrist"}, {{"hinge", M_PI / 2}, {"left", 0}});
  EXPECT_LT((wrist.joints[0].position - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);

  const auto outcome = [&](const std::vector<std::string>& names, const HeldJoints& still) {
    try {
      chain_of_urdf(urdf, "x.urdf", names, still);
    } catch (const BadData& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(outcome({"hinge", "wrist"}, {{"right", 0}}).find("'left' moves and is not"), std::string::npos);
  EXPECT_NE(outcome({"hinge", "wrist"}, {{"finger", 0}}).find("no joint 'finger'"), std::string::npos);
  EXPECT_NE(outcome({"hinge", "wrist"}, {{"wrist", 0}, {"left", 0}}).find("held and one"), std::string::npos);
  EXPECT_EQ(outcome({"hinge", "wrist"}, {{"left", 0}, {"right", 0.01}}), "accepted");
}

// Theory: a cloud of masses has a positive definite pseudo inertia, a body whose inertia breaks the triangle
// rule has not.
TEST(Body, PseudoInertiaShowsWhatIsPhysical) {
  Body b;
  b.mass = 2;
  b.centre = {0.1, -0.2, 0.3};
  b.inertia = Eigen::Vector3d(0.1, 0.1, 0.15).asDiagonal();
  EXPECT_TRUE(is_consistent(parameters_of(b)));
  const Body back = body_of(parameters_of(b));
  EXPECT_LT((back.inertia - b.inertia).norm() + (back.centre - b.centre).norm(), 1e-12);
  b.inertia = Eigen::Vector3d(0.1, 0.1, 0.25).asDiagonal();
  EXPECT_FALSE(is_consistent(parameters_of(b)));
}

}  // namespace
}  // namespace backlash::arm
