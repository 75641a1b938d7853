// SPDX-License-Identifier: BSD-3-Clause
// Plays of simulated arms, whose truth is known: right or "cannot tell", never the wrong joint.
#include <gtest/gtest.h>

#include "backlash_diagnosis/geared_arm/plant.h"
#include "backlash_diagnosis/geared_arm/play.h"
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

TEST(ArmPlay, PosesThatShowTheGapsTellBothPlays) {
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

TEST(ArmPlay, PosesThatHideTheGapsAreToldWithOneThatShowsThem) {
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
