// SPDX-License-Identifier: BSD-3-Clause
// Plays of simulated arms, whose truth is known: right or "cannot tell", never the wrong joint.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/geared_arm/play.h"
#include "backlash_diagnosis/geared_arm/simulation.h"
#include "support/data.h"

namespace backlash::geared_arm {
namespace {

using diagnosis::Status;

GearedArm arm_of(const std::string& name) {
  return load_geared_arm(test::package_file("config/two_link_arm/" + name + ".yaml"));
}

std::vector<JointPlay> diagnosed(const GearedArm& machine, const GearedArm& declared, double duration = 30) {
  std::vector<std::string> warnings;
  std::vector<JointLoad> loads;
  for (const GearedJoint& joint : declared.joints) loads.push_back({joint.link_coulomb, joint.link_viscous});
  return plays_of(declared.rig, loads,
                  arm::arm_record(simulate_arm(machine, duration), declared.rig, "simulated"), warnings);
}

TEST(ArmPlay, PosesThatShowTheGapsGiveBothPlays) {
  const GearedArm declared = arm_of("two_link_arm");
  for (const double shoulder : {5e-4, 2e-3, 6e-3}) {
    GearedArm machine = declared;
    machine.joints[0].gear->backlash = shoulder;
    const std::vector<JointPlay> plays = diagnosed(machine, declared);
    const double truth[] = {shoulder, 3e-3};
    for (std::size_t j = 0; j < 2; ++j) {
      const diagnosis::Estimate& e = plays[j].estimate;
      ASSERT_EQ(e.status, Status::ok) << plays[j].joint << ": " << e.message;
      EXPECT_NEAR(e.backlash_angle, truth[j], 0.1 * truth[j]);  // the promise of the page
      EXPECT_LE(e.angle_lower, truth[j]);
      EXPECT_GE(e.angle_upper, truth[j]);
    }
  }
}

TEST(ArmPlay, NeverTheWrongJoint) {
  const GearedArm declared = arm_of("two_link_arm");
  for (const std::size_t tight : {0, 1}) {
    GearedArm machine = declared;
    machine.joints[tight].gear->backlash = 0;
    const std::vector<JointPlay> plays = diagnosed(machine, declared);
    EXPECT_EQ(plays[tight].estimate.status, Status::below_range) << plays[tight].estimate.message;
    EXPECT_LT(plays[tight].estimate.angle_upper, 3e-4);  // a tenth of the other joint's play or less
    EXPECT_EQ(plays[1 - tight].estimate.status, Status::ok);
  }
}

TEST(ArmPlay, PosesThatHideTheGapsAreReportedWithOneThatShowsThem) {
  const GearedArm arm = arm_of("two_link_arm_hidden");
  for (const JointPlay& play : diagnosed(arm, arm)) {
    EXPECT_EQ(play.estimate.status, Status::out_of_domain);
    EXPECT_NE(play.estimate.message.find("cannot tell"), std::string::npos);
    EXPECT_TRUE(std::isnan(play.estimate.backlash_angle));
    EXPECT_TRUE(play.pose.has_value());
  }
}

TEST(ArmPlay, FrictionAndMassThatTheFileDoesNotKnowMakeNoWrongAnswer) {
  const GearedArm declared = arm_of("two_link_arm");
  GearedArm machine = declared;
  for (std::size_t j = 0; j < 2; ++j) {
    machine.joints[j].link_coulomb *= 1.8;
    machine.rig.chain.links[j] *= j == 0 ? 1.1 : 0.92;
    machine.joints[j].gear->contact =
        model::make_contact_law("hunt_crossley", {{"stiffness", 2e5}, {"exponent", 1.5}, {"alpha", 0.5}});
  }
  const double truth[] = {2e-3, 3e-3};
  const std::vector<JointPlay> plays = diagnosed(machine, declared);
  for (std::size_t j = 0; j < 2; ++j) {
    const diagnosis::Estimate& e = plays[j].estimate;
    if (e.status != Status::ok) continue;
    EXPECT_LE(e.angle_lower, truth[j]) << e.message;
    EXPECT_GE(e.angle_upper, truth[j]) << e.message;
  }
}

/// Poses, plays and contacts drawn; friction behind the gap that the file does not know.
TEST(ArmPlay, DrawnArmsAreRightOrUnknown) {
  Random random(3);
  GearedArm declared = arm_of("two_link_arm");
  int answered = 0, asked = 0;
  for (int i = 0; i < 12; ++i) {
    GearedArm machine = declared;
    const double centre = i % 3 == 0 ? 0 : -M_PI / 2, plays[] = {0, 2e-4, 1e-3, 4e-3};
    double truth[2];
    machine.sensors.seed = 10 * std::uint64_t(i);
    for (std::size_t j = 0; j < 2; ++j) {
      GearedJoint& joint = machine.joints[j];
      for (double& position : joint.excitation.moves.positions)
        position = (j == 0 ? centre : 0) + random.uniform(-1.2, 1.2);
      joint.gear->backlash = truth[j] = plays[int(random.uniform(0, 4))];
      if (random.uniform(0, 1) < 0.6) {  // powers between a spring and Hertz; rad at 5 or 2 N m
        const double exponent = random.uniform(1.05, 1.5), yields = random.uniform(5e-4, 2e-3);
        const double stiffness = (j == 0 ? 5 : 2) / std::pow(yields, exponent);
        joint.gear->contact = model::make_contact_law(
            "hunt_crossley", {{"stiffness", stiffness}, {"exponent", exponent}, {"alpha", 0.5}});
      }
    }
    for (GearedJoint& joint : declared.joints) joint.link_coulomb = 0;
    const std::vector<JointPlay> found = diagnosed(machine, declared);
    for (std::size_t j = 0; j < 2; ++j) {
      const diagnosis::Estimate& e = found[j].estimate;
      ++asked;
      if (e.status != Status::ok && e.status != Status::below_range) continue;
      ++answered;
      EXPECT_LE(e.angle_lower, truth[j]) << i << ' ' << j << ' ' << e.message;
      EXPECT_GE(e.angle_upper, truth[j]) << i << ' ' << j << ' ' << e.message;
      if (e.status == Status::below_range) continue;
      EXPECT_NEAR(e.backlash_angle, truth[j], 0.1 * truth[j]) << i << ' ' << j;
    }
  }
  std::cout << answered << " of " << asked << " answered\n";
  EXPECT_GE(answered, asked / 4);  // the rest stays on one flank
}

TEST(ArmPlay, APayloadThatTheFileDoesNotKnowMakesNoAnswer) {
  const GearedArm declared = arm_of("two_link_arm");
  GearedArm machine = declared;
  arm::Body payload;  // half as heavy as the forearm, at its end: gravity's moment at the elbow doubles
  payload.mass = 0.5;
  payload.centre = {0.3, 0, 0};
  machine.rig.chain.links[1] += arm::parameters_of(payload);
  for (const JointPlay& play : diagnosed(machine, declared)) {
    EXPECT_EQ(play.estimate.status, Status::out_of_domain) << play.joint;
    EXPECT_GT(play.disagreement, 0.1);
  }
}

/// The error of an eccentric encoder follows the angle as gravity's change of flank does.
TEST(ArmPlay, AnEncoderOutOfCentreMakesNoWrongAnswer) {
  const GearedArm arm = arm_of("two_link_arm");
  std::vector<record::JointRecord> joints = simulate_arm(arm, 30);
  for (double& q : joints[0].record.column(record::Channel::load_position)) q += 1e-3 * std::cos(q);
  std::vector<std::string> warnings;
  const auto plays = plays_of(arm.rig, {{0.05, 0.02}, {0.02, 0.01}},
                              arm::arm_record(joints, arm.rig, "simulated"), warnings);
  const diagnosis::Estimate& e = plays[0].estimate;
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_NEAR(e.backlash_angle, 2e-3, 0.1 * 2e-3);  // the promise of the page
  EXPECT_LE(e.angle_lower, 2e-3);
  EXPECT_GE(e.angle_upper, 2e-3);
}

/// Errors thrice per turn: the elbow's turns with the load's change of flank as no straight line does.
TEST(ArmPlay, AnEncoderThatIsWrongThricePerTurnMakesNoWrongAnswer) {
  GearedArm arm = arm_of("two_link_arm");
  for (GearedJoint& joint : arm.joints) joint.gear->backlash = 3e-4;
  const std::vector<record::JointRecord> joints = simulate_arm(arm, 30);
  for (const double phase : {0.0, M_PI / 2, M_PI, 3 * M_PI / 2}) {
    std::vector<record::JointRecord> shown = joints;
    for (record::JointRecord& joint : shown)
      for (double& q : joint.record.column(record::Channel::load_position))
        q += 1e-4 * std::sin(3 * q + phase);
    std::vector<std::string> warnings;
    const auto plays = plays_of(arm.rig, {{0.05, 0.02}, {0.02, 0.01}},
                                arm::arm_record(shown, arm.rig, "simulated"), warnings);
    EXPECT_EQ(plays[1].estimate.status, Status::ok) << phase << plays[1].estimate.message;
    for (const JointPlay& play : plays) {
      if (play.estimate.status != Status::ok && play.estimate.status != Status::below_range) continue;
      EXPECT_LE(play.estimate.angle_lower, 3e-4) << play.joint << phase;
      EXPECT_GE(play.estimate.angle_upper, 3e-4) << play.joint << phase;
    }
  }
}

/// Teeth give way to the load: encoders that show otherwise are not those of this joint, and no play follows.
TEST(ArmPlay, EncodersTheWrongWayRoundMakeNoAnswer) {
  GearedArm arm = arm_of("two_link_arm");
  for (const double travel : {1.0, 0.03}) {  // about the upright pose, and hardly off it
    for (GearedJoint& joint : arm.joints)
      for (double& position : joint.excitation.moves.positions) position *= travel;
    const std::vector<record::JointRecord> joints = simulate_arm(arm, 30);
    for (const bool backwards : {true, false}) {
      std::vector<record::JointRecord> shown = joints;
      for (record::JointRecord& joint : shown) {
        std::vector<double>& load = joint.record.column(record::Channel::load_position);
        if (backwards)
          for (double& q : load) q = -q;
        else
          load.swap(joint.record.column(record::Channel::motor_position));
      }
      std::vector<std::string> warnings;
      for (const JointPlay& play : plays_of(arm.rig, {{0.05, 0.02}, {0.02, 0.01}},
                                            arm::arm_record(shown, arm.rig, "simulated"), warnings)) {
        const diagnosis::Estimate& e = play.estimate;
        EXPECT_NE(e.status, Status::ok) << play.joint << travel << backwards;
        EXPECT_NE(e.status, Status::below_range) << play.joint << travel << backwards << e.message;
        if (travel == 1) EXPECT_EQ(e.status, Status::out_of_domain) << e.message;
      }
    }
  }
}

TEST(ArmPlay, OneEncoderIsNotEnough) {
  const GearedArm arm = arm_of("two_link_arm");
  std::vector<record::JointRecord> joints = simulate_arm(arm, 10);
  joints[0].record.column(record::Channel::load_position).clear();
  std::vector<std::string> warnings;
  const auto plays = plays_of(arm.rig, {{}, {}}, arm::arm_record(joints, arm.rig, "simulated"), warnings);
  EXPECT_EQ(plays[0].estimate.status, Status::insufficient_data);
  EXPECT_EQ(plays[0].estimate.message, "needs load_position");
}

}  // namespace
}  // namespace backlash::geared_arm
