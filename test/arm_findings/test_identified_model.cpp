// SPDX-License-Identifier: BSD-3-Clause
// Oracles: MuJoCo, which reads the written URDF or MJCF by itself and must need the torques of the identified
// chain; urdfdom; and the text, of which nothing else may change.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <memory>
#include <regex>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/arm_findings/identified_model.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"
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
  const IdentifiedModel out = identified_urdf(kRobot, "two.urdf", arm_);
  const arm::Chain chain = arm::chain_of_urdf(out.text, "out.urdf", arm_.rig.joint_names());
  for (std::size_t i = 0; i < 2; ++i) {
    arm::BodyParameters expected = arm_.rig.chain.links[i];
    if (i == 0) expected[0] = 2;                               // that no motion shows: the file's
    EXPECT_LT((chain.links[i] - expected).norm(), 1e-7) << i;  // printed with 8 digits
  }
  for (const char* kept :
       {"<!-- a comment with a > and a <tag> -->", R"(<link name="upper" ><!-- kept -->)",
        "<!-- from CAD -->", R"(rpy="0 0 0.5"  xyz = "0.225 0.015 0.03")", "<mass value='2.0' />",
        R"(<visual><geometry><box size="1 1 1"/></geometry></visual>)",
        R"(friction="1.5" damping="0.25"/>   <!-- guessed -->)",
        R"(<link name="tool"><inertial><mass value="0.5"/>)", R"(<dynamics damping="0.125" friction="0.5"/>)",
        "<!-- play: 0.002 rad, wall to wall -->"})
    EXPECT_NE(out.text.find(kept), std::string::npos) << kept << "\n" << out.text;
  ASSERT_EQ(out.kept.size(), 1u);
  EXPECT_EQ(out.kept[0], "upper: mass: no motion shows it");
  ASSERT_EQ(out.unsaid.size(), 1u);
  EXPECT_EQ(out.unsaid[0], "shoulder: offset 0.1 N m");
  // Written again it is the same.
  EXPECT_EQ(identified_urdf(out.text, "two.urdf", arm_).text.find(R"(damping="0.25" damping)"),
            std::string::npos);
}

TEST_F(IdentifiedUrdfFile, WhatIsNotIdentifiedKeepsItsText) {
  arm_.rig.fitted = false;
  for (arm::JointDrive& drive : arm_.rig.joints) drive.training_error = 0;
  arm_.joints[1].gear.reset();
  arm_.rig.terms.clear();
  const IdentifiedModel out = identified_urdf(kRobot, "two.urdf", arm_);
  EXPECT_EQ(out.text, kRobot);
  EXPECT_EQ(out.kept.size(), 2u);
}

TEST_F(IdentifiedUrdfFile, AMassThatNoBodyHasBesideTheRestIsThatOfTheRigFile) {
  const std::string light =
      std::regex_replace(std::string(kRobot), std::regex("mass value='2.0'"), "mass value='0.1'");
  const IdentifiedModel out = identified_urdf(light, "two.urdf", arm_);
  EXPECT_NE(out.text.find("<mass value='3' />"), std::string::npos) << out.text;
  EXPECT_EQ(out.written[0],
            "upper: mass of the rig file: no motion shows it, but with this file's no body has the rest");
}

TEST_F(IdentifiedUrdfFile, AnotherRobotAndNoXmlAreRefused) {
  const std::string longer = std::regex_replace(std::string(kRobot), std::regex("0.4 0 0"), "0.5 0 0");
  EXPECT_THROW(identified_urdf(longer, "x.urdf", arm_), BadData);
  EXPECT_THROW(identified_urdf("<robot>", "x.urdf", arm_), BadData);
}

TEST_F(IdentifiedUrdfFile, ABodyThatIsLighterThanWhatIsFixedToItKeepsItsValues) {
  arm_.rig.chain.links[1] *= 0.2;
  const IdentifiedModel out = identified_urdf(kRobot, "two.urdf", arm_);
  EXPECT_NE(out.text.find(R"(<link name="lower"/>)"), std::string::npos);
  EXPECT_NE(out.kept.back().find("lower: what is fixed to it weighs 0.5 kg"), std::string::npos)
      << out.kept.back();
}

// The same robot, but the frame of each body is its own, `shoulder` has its zero elsewhere, and the values of
// the joints come from default classes.
const char* const kMujoco = R"(<mujoco model="two">
  <!-- a comment with a > and a <tag> -->
  <compiler eulerseq="zyx" balanceinertia="false"/>
  <option gravity="0 0 -9.80665"/>
  <default>
    <joint damping="3" frictionloss="9"/>
    <default class="small"><joint armature="0.25"/><geom mass="0"/></default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="upper_body" pos="0 0.02 0.7" euler="0 30 0" childclass="small">
      <inertial pos="0 0 0.1" mass='2.0' diaginertia="0.01 0.02 0.025" xyaxes="0 1 0 -1 0 0"/><!-- kept -->
      <joint name="shoulder" axis="0 2 0" ref="30"/>
      <geom type="box" size="1 1 1"/>
      <body name="plate" pos="0.2 0.1 0" axisangle="0 1 0 90">
        <body name="lower_body" pos="0 -0.15 0.2">
          <joint
            name="elbow"   class="main" axis="0 1 0" damping="0.125"/>
          <body name="tool" pos="0 0.05 0.3" zaxis="0 0 1"><inertial mass="0.5" pos="0 0 0" fullinertia="0.001 0.001 0.001 0 0 0"/></body>
        </body>
      </body>
    </body>
    <body name="thing" pos="3 0 0"><freejoint/><geom size="0.1"/></body>
  </worldbody>
</mujoco>
)";

TEST_F(IdentifiedUrdfFile, OfMujocoHasTheValuesAndNothingElseIsTouched) {
  const IdentifiedModel out = identified_mjcf(kMujoco, "two.xml", arm_);
  for (const std::string& kept :
       {std::string(R"(name="shoulder" axis="0 2 0" ref="30" damping="0.25" frictionloss="1.5"/>)"),
        std::string(R"(class="main" axis="0 1 0" damping="0.125" frictionloss="0.5"/>)"),
        std::string(R"(<inertial pos="0.225 0.015 0.03" mass='2.0' fullinertia=")"),
        std::string(R"("/><!-- kept -->)")})
    EXPECT_NE(out.text.find(kept), std::string::npos) << kept << "\n" << out.text;
  // Without what was written, it is the file as it was.
  std::string rest = out.text;
  for (const char* written :
       {R"( damping="0.25" frictionloss="1.5")", R"( frictionloss="0.5"(?=/>\s*<))",
        R"( fullinertia="[^"]*"(?=/><!-- kept))", R"(\s*<inertial pos="[^"]*" mass="1" [^>]*>)"})
    rest = std::regex_replace(rest, std::regex(written), "");
  std::string before = std::regex_replace(
      std::string(kMujoco), std::regex(R"( diaginertia="0.01 0.02 0.025" xyaxes="0 1 0 -1 0 0")"), "");
  const auto without_pos = [](const std::string& t) {
    return std::regex_replace(t, std::regex(R"(<inertial pos="[^"]*")"), "<inertial");
  };
  EXPECT_EQ(without_pos(rest), without_pos(before));
  EXPECT_EQ(joined(out.unsaid),
            "shoulder: offset 0.1 N m, elbow: play 0.002 rad: a joint of MJCF has none; it takes a "
            "body of the motor's own and a tendon with limits, as export_model RIG.yaml --out JOINT.xml "
            "writes them for one joint");
  EXPECT_EQ(joined(out.kept),
            "upper_body: mass: no motion shows it, shoulder: armature 0.25: the rig file has no "
            "rotor_inertia, so the torques without it were fitted");
}

TEST_F(IdentifiedUrdfFile, OfMujocoKeepsWhatIsNotIdentified) {
  arm_.rig.fitted = false;
  arm_.rig.terms.clear();
  EXPECT_EQ(identified_mjcf(kMujoco, "two.xml", arm_).text, kMujoco);
}

TEST_F(IdentifiedUrdfFile, OfMujocoThatStandsOtherwiseIsNoted) {
  const std::string turned =
      std::regex_replace(std::string(kMujoco), std::regex(R"(ref="30")"), R"(ref="10")");
  EXPECT_NE(identified_mjcf(turned, "two.xml", arm_)
                .kept[0]
                .find("shoulder: gravity at angle 0, turned by 0.349 rad"),
            std::string::npos);
}

TEST_F(IdentifiedUrdfFile, OfMujocoIsRefusedWithLineAndRemedy) {
  const auto refused = [&](const char* what, const char* by, const std::string& message) {
    const std::string text = std::regex_replace(std::string(kMujoco), std::regex(what), by);
    ASSERT_NE(text, kMujoco) << what;
    try {
      identified_mjcf(text, "two.xml", arm_);
      ADD_FAILURE() << by;
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
  };
  refused("<option[^>]*>", "<include file='a.xml'/>",
          "two.xml:4: <include>: what other files hold is not known: let");
  refused("<freejoint/>", "<include file='a.xml'/>", "two.xml:23: <include>: bodies that this makes");
  refused(R"(name="elbow")", R"(name="e")",
          "two.xml: no joint 'elbow' as the rig file has it; there are: shoulder, e,");
  refused(R"(pos="0.2 0.1 0")", R"(pos="0.3 0.1 0")", "<joint>: the axis of joint 'shoulder' lies 50 mm and");
  refused(R"(class="main")", R"(class="none")", "two.xml:17: <joint>: there is no default class 'none'");
  refused(R"(childclass="small")", R"(childclass="none")", "there is no default class 'none'");
  refused(R"(class="main" axis="0 1 0")", R"(axis="0 -1 0")", "another zero (ref) or the other way round");
  refused(R"(class="main")", R"(type="slide")", "joint 'elbow' is no hinge");
  refused(R"(<body name="plate")", R"(<body name="plate"><joint name='third'/></body><body name='p2')",
          "joint 'third' moves and is not one of the rig's");
  refused(R"(<inertial mass="0.5"[^>]*>)", "<geom size='.1' mass='.5'/>",
          "body 'tool' has no inertial, MuJoCo takes its mass");
  refused(R"(balanceinertia="false")", R"(inertiafromgeom="true")",
          "two.xml:3: <compiler>: inertiafromgeom = true");
  refused(R"(balanceinertia="false")", R"(settotalmass="3")", "settotalmass = 3");
  refused(R"(balanceinertia="false")", R"(coordinate="global")", "coordinate = global");
  refused(R"(damping="3")", R"(damping="three")", "damping = 'three': not a number");
  refused("mujoco", "robot", "two.xml:1: <robot>: is no MuJoCo file");
}

#ifdef BACKLASH_DIAGNOSIS_MUJOCO
/// MuJoCo's torques of a file at drawn states beside those of the rig: chain, rotors, viscous friction of
/// `rig`.
void expect_the_rigs_torques(const std::string& path, const arm::ArmRig& rig, double tolerance) {
  char error[500] = "";
  const std::unique_ptr<mjModel, void (*)(mjModel*)> model(
      mj_loadXML(path.c_str(), nullptr, error, sizeof error), mj_deleteModel);
  ASSERT_NE(model, nullptr) << error;
  model->opt.gravity[2] = -9.80665;
  model->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_CONTACT;
  const std::unique_ptr<mjData, void (*)(mjData*)> data(mj_makeData(model.get()), mj_deleteData);
  Random random(3);
  const auto n = Eigen::Index(rig.joints.size());
  for (int i = 0; i < 20; ++i) {
    arm::Joints q(n), v(n), a(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      q[j] = data->qpos[j] = random.uniform(-3, 3);
      v[j] = data->qvel[j] = random.uniform(-2, 2);
      a[j] = data->qacc[j] = random.uniform(-5, 5);
    }
    mj_inverse(model.get(), data.get());
    const arm::Joints torque = arm::inverse_dynamics(rig.chain, q, v, a);
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto& terms = rig.joints[std::size_t(j)].terms;
      const double drive = terms[std::size_t(arm::DriveTerm::rotor_inertia)] * a[j] +
                           terms[std::size_t(arm::DriveTerm::viscous)] * v[j];
      EXPECT_NEAR(data->qfrc_inverse[j], torque[j] + drive, tolerance) << i << " " << j;
      EXPECT_NEAR(model->dof_frictionloss[j], terms[std::size_t(arm::DriveTerm::coulomb)], 1e-7);
    }
  }
}

TEST_F(IdentifiedUrdfFile, MujocoNeedsTheSameTorques) {
  const std::string path = folder_.path("out.urdf");
  std::string text = identified_urdf(kRobot, "two.urdf", arm_).text;
  // MuJoCo's URDF: bodies that are fixed stay bodies, and no plane of symmetry is made of an inertia.
  text.insert(text.find("<link"),
              R"(<mujoco><compiler fusestatic="false" balanceinertia="false"/></mujoco>)");
  std::ofstream(path) << text;
  expect_the_rigs_torques(path, arm_.rig, 1e-5);  // printed with 8 digits
}

TEST_F(IdentifiedUrdfFile, OfMujocoNeedsTheSameTorques) {
  arm_.rig.terms.push_back(arm::DriveTerm::rotor_inertia);
  arm_.rig.joints[0].terms[std::size_t(arm::DriveTerm::rotor_inertia)] = 0.4;
  std::ofstream(folder_.path("out.xml")) << identified_mjcf(kMujoco, "two.xml", arm_).text;
  expect_the_rigs_torques(folder_.path("out.xml"), arm_.rig, 1e-5);  // printed with 8 digits
}

/// A MuJoCo file of the chain in which each body's frame is drawn, and knows nothing of masses.
std::string drawn_mjcf(const arm::Chain& chain, Random& random) {
  const auto drawn = [&] {
    Eigen::Isometry3d frame(
        Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal()).normalized());
    frame.translation() = Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    return frame;
  };
  const auto text = [](const Eigen::VectorXd& v) {
    std::string out;
    for (const double x : v) out += fmt::format("{:.12g} ", x);
    return out;
  };
  std::string xml = "<mujoco><worldbody>", ends;
  Eigen::Isometry3d before = Eigen::Isometry3d::Identity();  // of the link in the body
  for (const arm::Joint& joint : chain.joints) {
    Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
    step.linear() = joint.rotation;
    step.translation() = joint.position;
    const Eigen::Isometry3d frame = drawn(), place = before * step * frame.inverse();
    const Eigen::Quaterniond q(place.linear());
    xml += "<body pos='" + text(place.translation()) + "' quat='" +
           text(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z())) + "'><joint name='" + joint.name + "' axis='" +
           text(frame.linear() * joint.axis) + "' pos='" + text(frame.translation()) + "'/>";
    before = frame;
    ends += "</body>";
  }
  return xml + ends + "</worldbody></mujoco>";
}

TEST_F(IdentifiedUrdfFile, OfMujocoNeedsTheSameTorquesInDrawnFrames) {
  geared_arm::GearedArm arm =
      geared_arm::load_geared_arm(test::package_file("config/ur10e_arm/ur10e_arm.yaml"));
  arm.rig.fitted = true;
  Random random(5);
  for (std::size_t j = 0; j < 6; ++j) {
    arm::Body body = arm::body_of(arm.rig.chain.links[j]);
    body.centre += Eigen::Vector3d(0.05, -0.1, 0.02) * random.normal();
    arm.rig.chain.links[j] = arm::parameters_of(body);
    arm.rig.joints[j].training_error = 0.1;
    for (const arm::DriveTerm term :
         {arm::DriveTerm::rotor_inertia, arm::DriveTerm::coulomb, arm::DriveTerm::viscous})
      arm.rig.joints[j].terms[std::size_t(term)] = random.uniform(0.1, 3);
  }
  for (int robot = 0; robot < 5; ++robot) {
    const std::string path = folder_.path("drawn.xml");
    const IdentifiedModel out = identified_mjcf(drawn_mjcf(arm.rig.chain, random), "drawn.xml", arm);
    EXPECT_EQ(out.written.size(), 12u);
    std::ofstream(path) << out.text;
    expect_the_rigs_torques(path, arm.rig, 1e-4);  // of up to 400 N m, printed with 8 digits
  }
}
#endif

}  // namespace
}  // namespace backlash::arm_findings
