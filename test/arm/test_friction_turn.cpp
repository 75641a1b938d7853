// SPDX-License-Identifier: BSD-3-Clause
// Oracle: machines whose friction turns its sign within 0.01 rad/s, or by Dahl's law; their chain's torques
// are KDL's.
#include <gtest/gtest.h>

#include "arm_machines.h"
#include "backlash_diagnosis/arm/friction_turn.h"
#include "backlash_diagnosis/arm/trace.h"

namespace backlash::arm {
namespace {

constexpr double kTrue = 0.01;  // rad/s, of test::Machine

struct Trained {
  ArmRig rig;
  std::vector<ArmMotion> motions;
  ArmFit fit;
};

Trained trained(const test::Machine& machine, double declared, std::size_t joint) {
  Trained t{machine.declared, {}, {}};
  t.rig.joints[joint].friction_speed = declared;
  std::vector<std::string> warnings;
  for (const ArmRecord& record : {machine.record(1), machine.record(2)})
    for (ArmMotion& m : motions_of(record, t.rig, warnings)) t.motions.push_back(std::move(m));
  t.fit = fit_arm_and_friction_turns(t.rig, t.motions);
  return t;
}

TEST(FrictionTurn, IsEstimatedWhereTheRigFileHasAnotherOne) {
  const Trained t = trained(test::Machine(5), 8 * kTrue, 1);
  for (std::size_t j = 0; j < t.rig.joints.size(); ++j) {
    // Octaves are tried; a low-pass of 5 Hz hardly shows what is below the true one.
    EXPECT_GE(t.rig.friction_speed(j), j == 1 ? kTrue : kTrue / 2) << j;
    EXPECT_LE(t.rig.friction_speed(j), j == 1 ? 2 * kTrue : kTrue) << j;
  }
  EXPECT_EQ(t.fit.rig.friction_speed(1), t.rig.friction_speed(1));
  const std::string said = t.fit.warnings.back();
  EXPECT_NE(said.find("not 0.08 as declared"), std::string::npos) << said;
}

TEST(FrictionTurn, StaysWhereItIsRight) {
  const Trained t = trained(test::Machine(6), kTrue, 0);
  for (std::size_t j = 0; j < t.rig.joints.size(); ++j) EXPECT_EQ(t.rig.friction_speed(j), kTrue) << j;
  EXPECT_TRUE(t.fit.warnings.empty());
}

/// 8 N m or so that build up over 0.4 mrad after each reversal, beside motion of a radian at 100 Hz.
TEST(FrictionTurn, APathIsFoundAndPredictsWhatNobodyHasSeen) {
  test::Machine machine(9);
  machine.affected = 1;
  machine.effect = {"presliding", 4e-4, "", {machine.drives[1].terms[std::size_t(DriveTerm::coulomb)], 0}};
  const Trained t = trained(machine, kTrue, 1);
  for (std::size_t j = 0; j < t.rig.joints.size(); ++j) EXPECT_EQ(t.rig.friction_speed(j), kTrue) << j;
  for (std::size_t j = 0; j < t.rig.joints.size(); ++j) {
    EXPECT_GE(t.rig.joints[j].friction_distance, j == 1 ? 2e-4 : 0) << j;  // octaves are tried
    EXPECT_LE(t.rig.joints[j].friction_distance, j == 1 ? 8e-4 : 0) << j;
  }
  const ArmRig back = arm_rig_from_text(arm_rig_text(t.fit.rig, {}), "written.yaml", "");
  EXPECT_EQ(back.joints[1].friction_distance, t.rig.joints[1].friction_distance);
  ArmFit with, without;
  with.rig = without.rig = back;
  without.rig.joints[1].friction_distance = 0;
  std::vector<std::string> warnings;
  const std::vector<ArmMotion> unseen = motions_of(machine.record(3), back, warnings);
  const auto error = [&](const ArmFit& fit) {
    std::vector<ArmMotion> moved = unseen;
    std::vector<FittedMotion> motions;
    for (ArmMotion& m : moved) {
      set_friction_turns(m, fit.rig);
      motions.push_back({&m, 0});
    }
    return relative_errors(fit, {}, motions, 1)[1];
  };
  EXPECT_LT(error(with), 0.8 * error(without));
}

TEST(FrictionTurn, MotionsHaveItAsIfTheyHadBeenReadWithIt) {
  const test::Machine machine(7);
  ArmRig rig = machine.declared;
  std::vector<std::string> warnings;
  const ArmRecord record = machine.record(1);
  std::vector<ArmMotion> turned = motions_of(record, rig, warnings);
  rig.joints[2].friction_speed = 0.05;
  set_friction_turns(turned[0], rig);
  const std::vector<ArmMotion> read = motions_of(record, rig, warnings);
  EXPECT_EQ(turned[0].sign, read[0].sign);
  for (std::size_t j = 0; j < rig.joints.size(); ++j) EXPECT_EQ(turned[0].drive[j], read[0].drive[j]);
}

// c (S' - S) of a v_0 that is too large has the shape of Stribeck's friction.
TEST(FrictionTurn, OneThatIsTooLargeIsNoStribeckFriction) {
  test::Machine machine(8);
  machine.declared.identification.friction_speed = 6 * kTrue;
  const ArmTrace trace =
      trace_arm(machine.declared, {machine.record(1), machine.record(2)}, machine.record(3), false);
  EXPECT_TRUE(trace.steps.empty()) << trace.steps[0].effect << " of " << trace.steps[0].joint;
  EXPECT_FALSE(trace.unexplained) << trace.unexplained->signature;
  const ArmRig back = arm_rig_from_text(arm_rig_text(trace.augmented, {}), "written.yaml", "");
  for (std::size_t j = 0; j < back.joints.size(); ++j) {
    EXPECT_EQ(back.friction_speed(j), trace.augmented.friction_speed(j));
    EXPECT_EQ(back.joints[j].friction_distance, trace.augmented.joints[j].friction_distance);
    // Octaves are tried; a path has nearly the shape of one between two of them.
    EXPECT_TRUE(back.friction_speed(j) < 2 * kTrue || back.joints[j].friction_distance > 0) << j;
  }
}

}  // namespace
}  // namespace backlash::arm
