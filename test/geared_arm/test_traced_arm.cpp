// SPDX-License-Identifier: BSD-3-Clause
// What an arm behind elastic gears lacks, traced: the records are simulated, their truth is known.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/arm/trace.h"
#include "backlash_diagnosis/geared_arm/simulation.h"
#include "support/data.h"

namespace backlash::geared_arm {
namespace {

using record::Channel;

GearedArm planar_arm() {
  return load_geared_arm(test::package_file("config/two_link_arm/two_link_arm.yaml"));
}

/// `shift`: of what the motors do, so that no record is another one's motion.
arm::ArmRecord recorded(GearedArm machine, double shift) {
  for (GearedJoint& joint : machine.joints) {
    joint.excitation.moves.positions.front() += shift;
    joint.excitation.moves.positions.back() -= shift;
  }
  machine.sensors.seed += std::uint64_t(1000 * std::fabs(shift));
  return arm::arm_record(simulate_arm(machine, 30), machine.rig, "simulated");
}

/// The chain of a planar arm knows nothing of a tilt about the axis that its links never leave.
TEST(TracedArm, APlanarArmShowsTheTiltThatItFeels) {
  const GearedArm declared = planar_arm();
  GearedArm tilted = declared;
  constexpr double kTilt = 0.12;  // rad: beyond small angles
  tilted.rig.chain.gravity = {9.80665 * std::sin(kTilt), 0, -9.80665 * std::cos(kTilt)};
  const arm::ArmTrace trace = arm::trace_arm(declared.rig, {recorded(declared, 0), recorded(declared, 0.2)},
                                             recorded(tilted, -0.2), false);
  ASSERT_EQ(trace.steps.size(), 1u);
  EXPECT_EQ(trace.steps[0].effect, "gravity_direction");
  const signal::Measured about_x = trace.steps[0].parameters[0].measured,
                         about_y = trace.steps[0].parameters[1].measured;
  EXPECT_NEAR(about_y.value, -kTilt, 3 * about_y.standard_error);
  EXPECT_LT(about_y.standard_error, 0.1 * kTilt);
  EXPECT_GT(about_x.standard_error, 0.2);  // as much as is known of any base
  for (const double after : trace.after) EXPECT_LT(after, 0.05);
}

/// Effects that the simulation puts on a drive are those that the trace names, by their values.
TEST(TracedArm, EffectsOfADriveAreNamedAsTheyWereSimulated) {
  const GearedArm declared = planar_arm();
  GearedArm machine = declared;
  machine.rig.joints[0].effects = {{"cogging", 6, "", {0.6, 0.8}}};
  machine.rig.joints[1].effects = {{"motor_torque_gain", 0, "", {0.2, 0}}};
  const arm::ArmTrace trace = arm::trace_arm(declared.rig, {recorded(declared, 0), recorded(declared, 0.2)},
                                             recorded(machine, -0.2), false);
  ASSERT_EQ(trace.steps.size(), 2u);
  for (const arm::ArmStep& step : trace.steps) {
    const bool gain = step.effect == "motor_torque_gain";
    EXPECT_EQ(step.effect, gain ? "motor_torque_gain" : "cogging");
    EXPECT_EQ(step.joint, gain ? "elbow" : "shoulder");
    const signal::Measured& size = step.parameters[0].measured;
    EXPECT_NEAR(size.value, gain ? 0.2 : 1, 3 * size.standard_error);
    EXPECT_LT(size.standard_error, 0.1 * size.value);
  }
  EXPECT_NE(trace.steps[0].effect, trace.steps[1].effect);
  EXPECT_FALSE(trace.unexplained) << trace.unexplained->signature;
}

/// Of a body at the end of a planar arm gravity shows moments; its mass follows from inertia alone. The right
/// values lie within three standard errors, and a body that is gone is not reported.
TEST(TracedArm, ABodyWhoseMassIsHardlyKnownIsReportedAsThat) {
  const GearedArm declared = planar_arm();
  GearedArm loaded = declared;
  arm::Body body;
  body.mass = 0.4;
  body.centre = {0.2, 0, 0.05};
  body.inertia = 1e-4 * Eigen::Matrix3d::Identity();
  loaded.rig.chain.links[1] += arm::parameters_of(body);
  const arm::ArmTrace trace = arm::trace_arm(declared.rig, {recorded(declared, 0), recorded(declared, 0.2)},
                                             recorded(loaded, -0.2), false);
  ASSERT_EQ(trace.steps.size(), 1u);
  EXPECT_EQ(trace.steps[0].effect, "payload");
  EXPECT_EQ(trace.steps[0].link, "forearm");
  const double truth[] = {0.4, 0.2, 0, 0.05};
  for (std::size_t i = 0; i < 4; ++i) {
    const arm::ArmParameter& p = trace.steps[0].parameters[i];
    EXPECT_NEAR(p.measured.value, truth[i], 3 * p.measured.standard_error) << p.name;
  }
  EXPECT_GT(trace.steps[0].parameters[2].measured.standard_error, 0.02);  // y: the axis of both joints
}

/// Of one link that turns slowly gravity shows a moment: a body that is gone on the other side does what one
/// on this side does. Both are said, and the values hold the truth of either.
TEST(TracedArm, WhatHasComeOrIsGoneIsSaidWhereBothExplainIt) {
  GearedArm declared = planar_arm();
  declared.joints.resize(1);
  declared.rig.joints.resize(1);
  declared.rig.chain.joints.resize(1);
  declared.rig.chain.links.resize(1);
  declared.joints[0].excitation.moves.speed = 0.4;
  declared.joints[0].excitation.moves.acceleration = 0.5;
  for (const int sign : {1, -1}) {
    arm::Body body;
    body.mass = 2;
    body.centre = {0.03, 0, 0};
    body.inertia = 1e-4 * Eigen::Matrix3d::Identity();
    GearedArm other = declared;
    other.rig.chain.links[0] += sign * arm::parameters_of(body);
    const arm::ArmTrace trace = arm::trace_arm(declared.rig, {recorded(declared, 0), recorded(declared, 0.2)},
                                               recorded(other, -0.2), false);
    ASSERT_EQ(trace.steps.size(), 1u) << sign;
    const arm::ArmStep& step = trace.steps[0];
    EXPECT_EQ(step.effect, "payload");
    EXPECT_EQ(step.equivalent_to, std::vector<std::string>{"payload (taken away)"}) << sign;
    const signal::Measured mass = step.parameters[0].measured;
    EXPECT_NEAR(mass.value, sign * 2, 3 * mass.standard_error) << sign;
  }
}

/// Gears that sag by 20 mrad under the links: with an encoder behind them the links are where that says.
TEST(TracedArm, LinksMoveAsTheirOwnEncodersSay) {
  GearedArm soft = planar_arm();
  for (GearedJoint& joint : soft.joints)
    joint.gear->contact = model::make_contact_law("linear", {{"stiffness", 500.0}, {"damping", 3.0}});
  const arm::ArmRecord record = recorded(soft, 0);
  std::vector<std::string> warnings;
  const auto by_links = arm::motions_of(record, soft.rig, warnings);
  EXPECT_TRUE(warnings.empty());
  arm::ArmRecord turned = record, other = record;
  for (double& q : turned.joints[0].column(Channel::load_position)) q += 0.7;  // another zero
  for (double& q : other.joints[0].column(Channel::load_position)) q *= 2;     // not this link's
  const auto same = arm::motions_of(turned, soft.rig, warnings);
  EXPECT_TRUE(warnings.empty());
  const auto by_motor = arm::motions_of(other, soft.rig, warnings);
  EXPECT_FALSE(warnings.empty());
  double sag = 0, zero = 0;
  for (Eigen::Index k = 0; k < by_links[0].q.rows(); ++k) {
    sag = std::fmax(sag, std::fabs(by_links[0].q(k, 0) - by_motor[0].q(k, 0)));
    zero = std::fmax(zero, std::fabs(same[0].q(k, 0) - by_motor[0].q(k, 0)));
  }
  EXPECT_GT(sag, 0.01);  // 9 N m of gravity over 500 N m/rad: 18 mrad
  EXPECT_LT(sag, 0.06);  // and what the motion adds
  EXPECT_LT(zero, 0.06);
  EXPECT_EQ(by_links[0].motor_v, by_motor[0].motor_v);
}

}  // namespace
}  // namespace backlash::geared_arm
