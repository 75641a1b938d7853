// SPDX-License-Identifier: BSD-3-Clause
// The chain behind a joint, and that each drafted file is one that the commands read.
#include <gtest/gtest.h>

#include <cmath>

#include "../support/data.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_draft/draft.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::rig_draft {
namespace {

constexpr double kG = 9.80665;

/// config/two_link_arm: rods of 0.3 m, 2 and 1 kg, inertia 0.015 and 0.0075 about their middles, level at 0.
UrdfLoad behind(std::size_t joint, double elbow) {
  const std::string path = test::package_file("config/two_link_arm/two_link_arm.urdf");
  return load_of_chain(arm::read_chain(path, {"shoulder", "elbow"}), joint, {0, elbow});
}

TEST(LoadOfChain, InertiaIsThatOfSteiner) {
  const double upper = 0.015 + 2 * 0.15 * 0.15, fore = 0.0075;
  // The forearm's centre is as far from the shoulder as the law of cosines says.
  for (const double elbow : {0.0, 0.7, M_PI_2, 3.0}) {
    const double square = 0.3 * 0.3 + 0.15 * 0.15 + 2 * 0.3 * 0.15 * std::cos(elbow);
    EXPECT_NEAR(behind(0, elbow).inertia, upper + fore + 1 * square, 1e-12) << elbow;
    EXPECT_NEAR(behind(1, elbow).inertia, fore + 0.15 * 0.15, 1e-12) << elbow;
  }
}

TEST(LoadOfChain, WeightIsThatOfLevers) {
  // Level: what holds the arm is m g d cos(q), upward turns being positive (axis -y).
  const Wave wave = behind(0, 0).gravity;
  EXPECT_NEAR(wave.amplitude, kG * (2 * 0.15 + 1 * 0.45), 1e-9);
  EXPECT_NEAR(wave.amplitude * std::sin(0 + wave.phase), kG * 0.75, 1e-9);
  EXPECT_NEAR(wave.amplitude * std::sin(M_PI_2 + wave.phase), 0, 1e-9);
}

SeenJoint seen_joint() {
  SeenJoint seen;
  seen.rate = 500, seen.duration = 30, seen.travel = 2, seen.fastest = 1, seen.acceleration = 4;
  SeenTorque torque;
  torque.explained = 0.95, torque.size = 20, torque.load = 8;
  torque.inertia = {1.5, 0.1}, torque.coulomb = {4, 0.3}, torque.viscous = {2, 0.4};
  seen.torque = torque;
  for (const record::Channel channel :
       {record::Channel::motor_torque, record::Channel::motor_position, record::Channel::load_position}) {
    seen.check.channels.emplace_back();
    seen.check.channels.back().channel = channel;
  }
  return seen;
}

JointPlace place() {
  return {"elbow", "run.bag", {}, false};
}

rig_file::RigFile read(const Draft& draft) {
  return rig_file::rig_file_from_text(draft.text, "draft.yaml");
}

TEST(DraftJoint, OneInertiaWhereNothingSaysHowItIsShared) {
  const Draft draft = draft_joint(seen_joint(), place(), std::nullopt, {});
  const rig_file::RigFile file = read(draft);
  EXPECT_TRUE(file.rig.mesh.rigid);
  EXPECT_NEAR(file.rig.motor.inertia, 1.5, 1e-3);
  EXPECT_FALSE(draft.has_play);
  EXPECT_NE(draft.text.find("FILL IN"), std::string::npos);
}

TEST(DraftJoint, RotorOfADataSheetIsSeenFromTheJoint) {
  Given given;
  given.reduction_ratio = 100, given.rotor_inertia = 5e-5, given.stiffness = 3e4;
  const rig_file::RigFile file = read(draft_joint(seen_joint(), place(), std::nullopt, given));
  EXPECT_NEAR(file.rig.motor.inertia, 0.5, 1e-3);  // 5e-5 times 100^2
  EXPECT_NEAR(file.rig.link.inertia, 1.0, 1e-3);   // the rest
  EXPECT_NEAR(file.rig.mesh.contact_spec().values.at("stiffness"), 3e4, 1);
  EXPECT_TRUE(file.diagnosis.gap_traverse);
}

TEST(DraftJoint, ChainOfTheUrdfIsTheLoad) {
  UrdfLoad load;
  load.file = "robot.urdf", load.inertia = 0.9, load.gravity = {12, 0.3}, load.pose = "alone";
  const rig_file::RigFile file = read(draft_joint(seen_joint(), place(), load, {}));
  EXPECT_NEAR(file.rig.link.inertia, 0.9, 1e-3);
  EXPECT_NEAR(file.rig.motor.inertia, 0.6, 1e-3);
  ASSERT_EQ(file.rig.terms.size(), 1u);
}

TEST(DraftJoint, SignalsOfTheMotorsShaftStayThere) {
  SeenJoint seen = seen_joint();
  seen.load = SeenLoad{50, 2e-3};
  seen.torque->inertia = {1.5 / 2500, 1e-5};
  const rig_file::RigFile file = read(draft_joint(seen, place(), std::nullopt, {}));
  EXPECT_TRUE(file.rig.motor_side);
  EXPECT_NEAR(file.rig.reduction_ratio, 50, 1e-9);
  // Both inertias together, seen from the joint, are what the record shows.
  EXPECT_NEAR(2500 * file.rig.motor.inertia + file.rig.link.inertia, 1.5, 1e-2);
}

TEST(DraftJoint, OtherSignsBecomeScalesOfABagAndWordsOfACsv) {
  SeenJoint seen = seen_joint();
  seen.load = SeenLoad{-1, 2e-3};
  seen.torque->reversed = true;
  JointPlace bag = place();
  bag.channels = record::usual_channels("elbow");
  bag.scalable = true;
  const rig_file::RigFile file = read(draft_joint(seen, bag, std::nullopt, {}));
  for (const record::ChannelSource& s : file.channels.sources) {
    const bool turned =
        s.channel == record::Channel::load_position || s.channel == record::Channel::motor_torque;
    EXPECT_EQ(s.scale, turned ? -1 : 1) << record::channel_name(s.channel);
  }
  const Draft csv = draft_joint(seen, place(), std::nullopt, {});
  EXPECT_NE(csv.text.find("turns against motor_position"), std::string::npos);
}

TEST(DraftJoint, NeitherTorqueNorUrdfShowsNoInertia) {
  SeenJoint seen = seen_joint();
  seen.torque.reset();
  EXPECT_THROW(draft_joint(seen, place(), std::nullopt, {}), CannotIdentify);
  UrdfLoad load;
  load.file = "robot.urdf", load.inertia = 0.9, load.pose = "alone";
  EXPECT_NEAR(read(draft_joint(seen, place(), load, {})).rig.link.inertia, 0.9, 1e-3);
}

TEST(DraftJoint, NamesOfAnyKindAreReadBack) {
  JointPlace odd = place();
  odd.joint = "arm/elbow: \"left\" #2";
  EXPECT_EQ(read(draft_joint(seen_joint(), odd, std::nullopt, {})).rig.joint, odd.joint);
}

}  // namespace
}  // namespace backlash::rig_draft
