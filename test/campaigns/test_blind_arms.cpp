// SPDX-License-Identifier: BSD-3-Clause
// The arms of arm_blind_study: an energy balance, torques in closed form, and answers on one of them.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tools/command_runner.h"

#ifdef BACKLASH_DIAGNOSIS_MUJOCO
#include "campaigns/blind_arms/world.h"
#endif

namespace backlash::test {
namespace {

#ifdef BACKLASH_DIAGNOSIS_MUJOCO

using blind_arms::World;

class BlindArms : public CommandTest {};

/// Two links that fall, without friction and damping; play in both joints.
blind_arms::Arm falling(blind_arms::Teeth teeth, bool bends) {
  blind_arms::Arm arm = blind_arms::drawn_arm(3, "clean");
  arm.joints.resize(2);
  for (blind_arms::Joint& j : arm.joints) {
    j.coulomb = j.viscous = j.link_coulomb = j.link_viscous = j.damping = 0;
    j.teeth = teeth;
    j.play = 4e-3;
    j.axis = {0, 1, 0};
    if (!bends) continue;
    j.bend_stiffness = j.stiffness;
    j.flange = 0.1 * j.rotor;
  }
  return arm;
}

TEST_F(BlindArms, EnergyIsWhatTheMotorsGive) {
  for (const auto teeth : {blind_arms::Teeth::spring, blind_arms::Teeth::power, blind_arms::Teeth::hardening})
    for (const bool bends : {false, true}) {
      const blind_arms::Arm arm = falling(teeth, bends);
      World world(arm, path("arm.xml"));
      std::vector<double> torque(2, 0);
      double work = 0, least = 0, most = 0, worst = 0, twist = 0;
      const double begin = world.energy();
      while (world.time() < 1.5) {
        for (std::size_t j = 0; j < 2; ++j)
          torque[j] = 0.2 * blind_arms::carried_weight(arm, j) * std::sin(7 * world.time() + double(j));
        const double before[] = {world.motor(0), world.motor(1)};
        world.step(torque);
        for (std::size_t j = 0; j < 2; ++j) work += torque[j] * (world.motor(j) - before[j]);
        least = std::fmin(least, work), most = std::fmax(most, work);
        worst = std::fmax(worst, std::fabs(world.energy() - begin - work));
        twist = std::fmax(twist, std::fabs(world.twist(0)));
      }
      EXPECT_GT(twist, arm.joints[0].play / 2);  // the teeth did meet
      // A step of 25 us in cycles of 40 Hz: 0.006 of what the teeth hold goes to and fro.
      EXPECT_LT(worst, 0.01 * (most - least)) << int(teeth) << bends;
    }
}

TEST_F(BlindArms, TeethHoldTheWeightInClosedForm) {
  blind_arms::Arm arm = falling(blind_arms::Teeth::spring, false);
  for (blind_arms::Joint& j : arm.joints) j.damping = 0.3 * std::sqrt(j.stiffness * j.rotor);
  arm.joints[1].place[2] = 0;
  for (blind_arms::Joint& j : arm.joints) j.centre[2] = 0;
  World world(arm, path("arm.xml"));
  std::vector<double> torque(2, 0);
  while (world.time() < 4) {  // held stretched out
    for (std::size_t j = 0; j < 2; ++j) {
      const blind_arms::Joint& joint = arm.joints[j];
      torque[j] =
          world.bias(j) - 20 * joint.speed_gain * world.motor(j) - joint.speed_gain * world.motor_rate(j);
    }
    world.step(torque);
  }
  for (std::size_t j = 0; j < 2; ++j) {
    const blind_arms::Joint& joint = arm.joints[j];
    const double held = std::fabs(blind_arms::teeth_torque(joint, world.twist(j), 0));
    EXPECT_NEAR(held, blind_arms::carried_weight(arm, j), 1e-3 * blind_arms::carried_weight(arm, j)) << j;
  }
}

TEST_F(BlindArms, TheStudyCountsOnFilesThatItKeeps) {
  const Outcome outcome =
      run("arm_blind_study --arms 1 --seed 1008 --kind clean --duration 12 --out . --json answers.json");
  EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  expect_contains(outcome.out, "| clean ");
  const auto truth = nlohmann::ordered_json::parse(read("1008_clean/truth.json"));
  std::istringstream lines(read("answers.json"));
  std::string line;
  std::size_t joints = 0;
  for (; std::getline(lines, line); ++joints) {
    const auto answer = nlohmann::ordered_json::parse(line);
    EXPECT_EQ(answer.at("truth"), truth.at("joints").at(joints).at("play"));
  }
  EXPECT_EQ(joints, truth.at("joints").size());
  EXPECT_EQ(run("arm_blind_study --ask nobody").code, 64);
}

/// A motor that gives less than it shows: named, of its joint, the value as it was drawn.
TEST_F(BlindArms, TheStudyCountsEffectsOfJoints) {
  const Outcome outcome =
      run("arm_blind_study --ask effects --kind gain --arms 1 --seed 3001 --duration 24 --out . --json "
          "answers.json");
  EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  expect_contains(outcome.out, "| gain | 1 | 1 | 1 | 0 | 0 |");
  const auto answer = nlohmann::ordered_json::parse(read("answers.json"));
  EXPECT_EQ(answer.at("truth").get<std::string>().substr(0, 24), "motor_torque_gain joint1");
  EXPECT_EQ(answer.at("steps").at(0).get<std::string>().substr(0, 24), "motor_torque_gain joint1");
}

#else

TEST(BlindArms, NeedMujoco) {
  GTEST_SKIP() << "no MuJoCo: libmujoco-dev";
}

#endif

}  // namespace
}  // namespace backlash::test
