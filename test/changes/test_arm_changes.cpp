// SPDX-License-Identifier: BSD-3-Clause
// Oracle: arms whose torques KDL computes, that change at a known time. Intervals hold with 95 %; the seeds
// are fixed, so that the tests are not chance: three standard errors are allowed.
#include <gtest/gtest.h>

#include <algorithm>

#include "arm/arm_machines.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/changes/arm_changes.h"

namespace backlash::changes {
namespace {

constexpr double kSince = 33;  // s

std::string text_of(const Changes& changes) {
  std::string text = "cannot tell: " + changes.cannot_tell;
  for (const Change& c : changes.changes)
    text += "\n" + c.effect + " of " + c.joint + " since " + to_text(c.since) + ", like " + joined(c.alike);
  return text + "\n" + joined(changes.warnings);
}

/// The healthy arm in two tasks, then in a third one, another from kSince on and healthy again from `until`.
Changes changes_of(const test::Machine& healthy, const test::Machine& changed, std::uint64_t seed) {
  return detect_changes(healthy.declared, {healthy.record(10 * seed, 40), healthy.record(10 * seed + 1, 40)},
                        healthy.record(10 * seed + 2, 60, changed, kSince));
}

test::Machine carrying(test::Machine machine, std::size_t link, double mass) {
  arm::Body body;
  body.mass = mass;
  body.centre = {0.05, -0.05, 0.1};
  machine.chain.links[link] += arm::parameters_of(body);
  return machine;
}

/// The only one; an empty one where it is not.
Change only(const Changes& changes) {
  EXPECT_EQ(changes.changes.size(), 1U) << text_of(changes);
  EXPECT_EQ(changes.cannot_tell, "") << text_of(changes);
  return changes.changes.size() == 1 ? changes.changes.front() : Change();
}

void expect_since(const Change& change, double since) {
  EXPECT_LE(change.since_from, since) << change.effect;
  EXPECT_GE(change.since_to, since) << change.effect;
  EXPECT_LT(change.since_to - change.since_from, 5) << change.effect;  // slow tasks show it within a second
}

void expect_size(const Change& change, const std::string& name, double truth) {
  for (const ChangeSize& s : change.size)
    if (s.name == name) {
      EXPECT_NEAR(s.measured.value, truth, 3 * s.measured.standard_error) << name;
      return;
    }
  ADD_FAILURE() << change.effect << " has no " << name;
}

TEST(ArmChanges, AHealthyArmInAnotherTaskIsNotChanged) {
  for (const std::uint64_t seed : {1, 2}) {
    const test::Machine machine(seed);
    const Changes found = changes_of(machine, machine, seed);
    EXPECT_TRUE(found.changes.empty() && found.cannot_tell.empty()) << text_of(found);
    EXPECT_GT(found.windows, 10U);
  }
}

TEST(ArmChanges, WhatItTakesUpIsReportedWithMassAndPlace) {
  const test::Machine machine(2);
  const Changes found = changes_of(machine, carrying(machine, 5, 2), 2);
  const Change change = only(found);
  EXPECT_EQ(change.effect, "payload");
  EXPECT_EQ(change.link, "wrist_3_link");
  // 2 kg at 0.1 m against the noise of the drives; what is left is that of the healthy machine.
  EXPECT_GT(change.error_before, 2 * found.noise);
  EXPECT_LT(change.error_after, 1.5 * found.noise);
  expect_since(change, kSince);
  expect_size(change, "mass", 2);
  expect_size(change, "centre_x", 0.05);
  expect_size(change, "centre_y", -0.05);
  expect_size(change, "centre_z", 0.1);
  EXPECT_EQ(change.until, std::nullopt);
}

TEST(ArmChanges, WhatHangsAtTheForearmIsNotNamedAtTheTool) {
  const test::Machine machine(1);
  const Change change = only(changes_of(machine, carrying(machine, 2, 2), 1));
  EXPECT_EQ(change.link, "forearm_link");
  expect_size(change, "mass", 2);
}

// What was taken up before the record is put down within it: a body that is no longer there.
TEST(ArmChanges, WhatIsPutDownHasANegativeMass) {
  const test::Machine machine(3);
  const test::Machine loaded = carrying(machine, 5, 1.5);
  const Change change = only(detect_changes(machine.declared, {loaded.record(31, 40), loaded.record(32, 40)},
                                            loaded.record(33, 60, machine, kSince)));
  EXPECT_EQ(change.effect, "payload");
  expect_size(change, "mass", -1.5);
  expect_since(change, kSince);
}

TEST(ArmChanges, FrictionIsNamedAtItsJoint) {
  const test::Machine machine(4);
  test::Machine rubbing = machine;
  rubbing.drives[3].terms[std::size_t(arm::DriveTerm::coulomb)] *= 1.3;
  const Change change = only(changes_of(machine, rubbing, 4));
  EXPECT_EQ(change.effect, "motor_coulomb");
  EXPECT_EQ(change.joint, "wrist_1_joint");
  expect_since(change, kSince);
  const double added = 0.3 * machine.drives[3].terms[std::size_t(arm::DriveTerm::coulomb)];
  // Torque constants are declared to 10 %, and so is what follows from them alone.
  EXPECT_NEAR(change.size.front().measured.value, added, 0.15 * added);
}

TEST(ArmChanges, AnEncoderThatSlipsIsNoPayload) {
  const test::Machine machine(2);
  test::Machine slipped = machine;
  slipped.slip[2] = 0.02;
  const Change change = only(changes_of(machine, slipped, 2));
  EXPECT_EQ(change.effect, "encoder_slip");
  EXPECT_EQ(change.joint, "elbow_joint");
  expect_size(change, "offset", 0.02);
}

// From its beginning the robot rubs a tenth more, as after a cold night, and carries another tool: no change
// within the record, and said.
TEST(ArmChanges, AnotherDayAndAnotherToolAreNoChangeWithinTheRecord) {
  const test::Machine machine(5);
  test::Machine cold = carrying(machine, 5, 1);
  for (arm::JointDrive& drive : cold.drives) drive.terms[std::size_t(arm::DriveTerm::coulomb)] *= 1.1;
  const Changes found =
      detect_changes(machine.declared, {machine.record(51, 40), machine.record(52, 40)}, cold.record(53, 60));
  EXPECT_TRUE(found.changes.empty()) << text_of(found);
  EXPECT_NE(std::find(found.different.begin(), found.different.end(), "payload at wrist_3_link"),
            found.different.end())
      << text_of(found);
}

// Friction is 30 % larger and falls while the robot warms up, as it did when it was learned from cold.
TEST(ArmChanges, WarmingUpIsNoChange) {
  const test::Machine machine(6);
  test::Machine cold = machine;
  cold.cold = 0.3;
  const Changes found =
      detect_changes(machine.declared, {cold.record(61, 60), machine.record(62, 40)}, cold.record(63, 60));
  EXPECT_TRUE(found.changes.empty()) << text_of(found);
}

// Taken up and put down again and again, each time for 20 s: too much for one record, but nothing else is
// reported.
TEST(ArmChanges, WhatIsTakenUpAndPutDownAgainAndAgainIsNothingElse) {
  const test::Machine machine(7);
  arm::ArmRecord record = machine.record(71, 130);
  const arm::ArmRecord loaded = carrying(machine, 5, 2).record(71, 130);
  for (std::size_t j = 0; j < record.joints.size(); ++j)
    for (std::size_t k = 0; k < record.joints[j].size(); ++k)
      if (int(record.joints[j].time[k] / 20) % 2 == 1)
        record.joints[j].column(record::Channel::motor_current)[k] =
            loaded.joints[j].column(record::Channel::motor_current)[k];
  const Changes found =
      detect_changes(machine.declared, {machine.record(72, 40), machine.record(73, 40)}, record);
  EXPECT_FALSE(found.changes.empty() && found.cannot_tell.empty()) << text_of(found);
  for (const Change& c : found.changes)
    EXPECT_TRUE(c.effect == "payload" || c.effect == "unknown") << text_of(found);
}

// A joint that stands still in this task may have changed and nobody would see it.
TEST(ArmChanges, AJointThatDoesNotMoveIsNotCalledHealthy) {
  const test::Machine machine(8);
  arm::ArmRecord record = machine.record(81, 60);
  record::Record& still = record.joints[5];
  for (const record::Channel c :
       {record::Channel::motor_position, record::Channel::motor_velocity, record::Channel::motor_current})
    std::fill(still.column(c).begin(), still.column(c).end(), c == record::Channel::motor_position ? 0.3 : 0);
  const Changes found =
      detect_changes(machine.declared, {machine.record(82, 40), machine.record(83, 40)}, record);
  ASSERT_EQ(found.unjudged.size(), 1U) << text_of(found);
  EXPECT_EQ(found.unjudged[0].joint, "wrist_3_joint");
  EXPECT_NE(found.unjudged[0].why.find("moves for"), std::string::npos) << found.unjudged[0].why;
}

TEST(ArmChanges, AnArmThatDoesNotMoveEnoughIsRefused) {
  const test::Machine machine(1);
  EXPECT_THROW(detect_changes(machine.declared, {machine.record(1, 40)}, machine.record(2, 7)),
               CannotIdentify);
  EXPECT_THROW(detect_changes(machine.declared, {machine.record(1, 3)}, machine.record(2, 40)), BadData);
}

}  // namespace
}  // namespace backlash::changes
