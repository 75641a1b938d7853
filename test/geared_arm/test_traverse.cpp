// SPDX-License-Identifier: BSD-3-Clause
// Plays of simulated arms with the motors' encoders alone, whose truth is known: right or "cannot tell",
// never the wrong joint. How often is counted by campaigns/arm_traverse.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/geared_arm/simulation.h"
#include "backlash_diagnosis/geared_arm/traverse.h"
#include "support/data.h"

namespace backlash::geared_arm {
namespace {

using diagnosis::Status;
using record::Channel;

constexpr double kDuration = 20;  // s

GearedArm arm_of(const std::string& name) {
  return load_geared_arm(test::package_file("config/two_link_arm/" + name + ".yaml"));
}

std::vector<JointTraverse> diagnosed(const GearedArm& machine, const GearedArm& declared) {
  std::vector<record::JointRecord> joints = simulate_arm(machine, kDuration);
  for (record::JointRecord& joint : joints) joint.record.column(Channel::load_position).clear();
  std::vector<std::string> warnings;
  return traverses_of(declared, arm::arm_record(joints, declared.rig, "simulated"), warnings);
}

void expect_play(const diagnosis::Estimate& e, double truth) {
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_NEAR(e.backlash_angle, truth, 0.1 * truth);  // the promise of the page
  EXPECT_LE(e.angle_lower, truth);
  EXPECT_GE(e.angle_upper, truth);
  EXPECT_EQ(e.method, "gap_traverse");
}

/// The interval of a joint without play holds none: an upper end, or no answer.
void expect_no_play(const diagnosis::Estimate& e) {
  EXPECT_NE(e.status, Status::ok) << e.backlash_angle << " rad: " << e.message;
  EXPECT_TRUE(std::isnan(e.backlash_angle));
}

TEST(ArmTraverse, TheMotorsAloneShowBothPlaysAndWhereTheyWereCrossed) {
  const GearedArm arm = arm_of("two_link_arm");
  const std::vector<JointTraverse> found = diagnosed(arm, arm);
  expect_play(found[0].estimate, 2e-3);
  expect_play(found[1].estimate, 3e-3);
  for (const JointTraverse& joint : found) {
    EXPECT_LT(joint.misfit, 1.5);           // the simulated machine is the fitted one: noise is left
    ASSERT_GE(joint.crossings.size(), 4u);  // fewer would not have been reported
    for (const Crossing& crossing : joint.crossings) {
      EXPECT_EQ(crossing.pose.size(), 2u);
      EXPECT_GT(crossing.duration, 0);
      EXPECT_LE(crossing.time, kDuration);
    }
  }
}

TEST(ArmTraverse, EffectsOfTheRigFileAreTakenOffTheTorque) {
  const GearedArm plain = arm_of("two_link_arm");
  GearedArm machine = plain;
  machine.rig.joints[0].effects = {{"cogging", 6, "", {0.3, 0.4}},
                                   {"transmission_coupling", 0, plain.rig.joints[1].name, {0.2, 0}}};
  machine.rig.joints[1].effects = {{"motor_torque_gain", 0, "", {0.3, 0}}};
  const std::vector<JointTraverse> known = diagnosed(machine, machine), unknown = diagnosed(machine, plain);
  const double truth[] = {2e-3, 3e-3};
  for (std::size_t j = 0; j < 2; ++j) {
    expect_play(known[j].estimate, truth[j]);
    EXPECT_LT(known[j].misfit, 1.5) << j;  // as of a machine without effects
    if (unknown[j].estimate.status == Status::ok) expect_play(unknown[j].estimate, truth[j]);
  }
}

TEST(ArmTraverse, NeverTheWrongJoint) {
  const GearedArm declared = arm_of("two_link_arm");
  for (const std::size_t tight : {0, 1}) {
    GearedArm machine = declared;
    machine.joints[tight].gear->backlash = 0;
    const std::vector<JointTraverse> found = diagnosed(machine, declared);
    expect_no_play(found[tight].estimate);
    expect_play(found[1 - tight].estimate, machine.joints[1 - tight].gear->backlash);
  }
}

/// Twice as soft as declared, a forearm half as heavy again, friction 30 % off: none of it is play.
TEST(ArmTraverse, AMachineWithoutPlayThatTheFileDoesNotKnowHasNone) {
  const GearedArm declared = arm_of("two_link_arm");
  GearedArm machine = declared;
  arm::Body payload;
  payload.mass = 0.5;
  payload.centre = {0.3, 0, 0};
  machine.rig.chain.links[1] += arm::parameters_of(payload);
  const double stiffness[] = {4000, 1500}, damping[] = {6, 2};
  for (std::size_t j = 0; j < 2; ++j) {
    machine.joints[j].gear->backlash = 0;
    machine.joints[j].gear->contact =
        model::make_contact_law("linear", {{"stiffness", stiffness[j]}, {"damping", damping[j]}});
    machine.rig.joints[j].terms[std::size_t(arm::DriveTerm::coulomb)] *= 1.3;
  }
  for (const JointTraverse& joint : diagnosed(machine, declared)) expect_no_play(joint.estimate);
}

/// The shoulder's encoder is wrong along the turn: what its teeth throw on the elbow is not known either.
TEST(ArmTraverse, NothingIsReportedBesideAJointThatIsNotExplained) {
  const GearedArm arm = arm_of("two_link_arm");
  std::vector<record::JointRecord> joints = simulate_arm(arm, kDuration);
  for (record::JointRecord& joint : joints) joint.record.column(Channel::load_position).clear();
  for (double& q : joints[0].record.column(Channel::motor_position)) q += 5e-5 * std::sin(50 * q);
  std::vector<std::string> warnings;
  const std::vector<JointTraverse> found =
      traverses_of(arm, arm::arm_record(joints, arm.rig, "simulated"), warnings);
  EXPECT_NE(found[0].estimate.message.find("times the noise is left"), std::string::npos)
      << found[0].estimate.message;
  EXPECT_EQ(found[1].estimate.status, Status::out_of_domain) << found[1].estimate.backlash_angle;
  EXPECT_NE(found[1].estimate.message.find("shoulder"), std::string::npos) << found[1].estimate.message;
}

TEST(ArmTraverse, ALoadThatNeverTurnsShowsNoPlay) {
  const GearedArm arm = arm_of("two_link_arm_hidden");
  for (const JointTraverse& joint : diagnosed(arm, arm)) {
    expect_no_play(joint.estimate);
    EXPECT_NE(joint.estimate.message.find("cannot tell"), std::string::npos) << joint.estimate.message;
    EXPECT_TRUE(joint.crossings.empty());
  }
}

/// The shoulder's load reaches 6.7 N m on the flank that is loaded less: 5 N m of friction hide a gap.
TEST(ArmTraverse, ALoadThatTheMotorsFrictionHidesShowsNoPlay) {
  GearedArm rough = arm_of("two_link_arm");
  rough.rig.joints[0].terms[std::size_t(arm::DriveTerm::coulomb)] = 5;
  const std::vector<JointTraverse> found = diagnosed(rough, rough);
  EXPECT_EQ(found[0].estimate.status, Status::out_of_domain);
  EXPECT_NE(found[0].estimate.message.find("dry friction"), std::string::npos) << found[0].estimate.message;
  EXPECT_TRUE(found[0].crossings.empty());
}

TEST(ArmTraverse, WhatIsMissingIsSaid) {
  GearedArm arm = arm_of("two_link_arm");
  std::vector<record::JointRecord> joints = simulate_arm(arm, 10);
  for (record::JointRecord& joint : joints) joint.record.column(Channel::load_position).clear();
  arm.joints[0].gear.reset();
  arm.joints[1].gear->contact = model::make_contact_law("linear", {{"stiffness", 3e6}, {"damping", 4}});
  std::vector<std::string> warnings;
  const auto found = traverses_of(arm, arm::arm_record(joints, arm.rig, "simulated"), warnings);
  EXPECT_EQ(found[0].estimate.status, Status::insufficient_data);
  EXPECT_NE(found[0].estimate.message.find("needs load_position, or gear.contact"), std::string::npos);
  EXPECT_EQ(found[1].estimate.status, Status::insufficient_data);
  EXPECT_NE(found[1].estimate.message.find("do not resolve the cycle"), std::string::npos);
}

}  // namespace
}  // namespace backlash::geared_arm
