// SPDX-License-Identifier: BSD-3-Clause
// Records whose channels count otherwise than the rig file says. The motion is in closed form: what the
// torque is spent on is known without the code.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "../support/servo.h"
#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/record/motion_sense.h"
#include "backlash_diagnosis/rig_file/declared_motion.h"

namespace backlash::rig_file {
namespace {

constexpr double kInterval = 1e-3, kDuration = 10;  // s

struct Columns {
  std::vector<double> torque, motor, load;
};

/// Two sines of position; inertia, viscous and dry friction, and a weight that pulls like a pendulum's.
Columns moved(double inertia, double viscous, double coulomb, double weight = 0) {
  Columns c;
  for (double t = 0; t < kDuration; t += kInterval) {
    const double q = 0.3 * std::sin(2 * M_PI * 0.5 * t) + 0.1 * std::sin(2 * M_PI * 1.3 * t + 1);
    const double w =
        0.3 * M_PI * std::cos(2 * M_PI * 0.5 * t) + 0.1 * 2 * M_PI * 1.3 * std::cos(2 * M_PI * 1.3 * t + 1);
    const double a = -0.3 * M_PI * M_PI * std::sin(2 * M_PI * 0.5 * t) -
                     0.1 * std::pow(2 * M_PI * 1.3, 2) * std::sin(2 * M_PI * 1.3 * t + 1);
    c.torque.push_back(inertia * a + viscous * w + std::copysign(coulomb, w) + weight * std::sin(q));
    c.motor.push_back(q);
    c.load.push_back(q - 1e-6 * a);
  }
  return c;
}

std::vector<record::Finding> findings(const Columns& c, const model::Rig& rig, double interval = kInterval) {
  return record::sense_of({interval, c.torque, c.motor, c.load}, declared_motion(rig));
}

/// What is refused; empty: nothing.
std::string refusal(const Columns& c, const model::Rig& rig, double interval = kInterval) {
  for (const record::Finding& finding : findings(c, rig, interval))
    if (finding.consequence == record::Consequence::refused) return finding.message;
  return "";
}

Columns scaled(Columns c, double torque, double motor, double load) {
  for (double& x : c.torque) x *= torque;
  for (double& x : c.motor) x *= motor;
  for (double& x : c.load) x *= load;
  return c;
}

const model::Rig& servo() {
  static const model::Rig rig = model::load_side(test::other_servo());
  return rig;
}

double all() {
  return servo().motor.inertia + servo().link.inertia;
}

Columns good() {
  return moved(all(), 20, 60);
}

TEST(RecordSense, LeavesAMachineAlone) {
  EXPECT_EQ(refusal(good(), servo()), "");
  EXPECT_EQ(refusal(scaled(good(), -1, -1, -1), servo()), "");  // all the other way round is the same machine
  for (const double weight : {-2000.0, 2000.0}) EXPECT_EQ(refusal(moved(all(), 20, 60, weight), servo()), "");
  EXPECT_EQ(refusal(moved(all(), -30, -60), servo()), "");  // driven along, as by a hand
}

TEST(RecordSense, NamesTheSignThatIsWrong) {
  const std::string torque = refusal(scaled(good(), -1, 1, 1), servo());
  EXPECT_NE(torque.find("motor_torque works against the motion"), std::string::npos) << torque;
  const std::string load = refusal(scaled(good(), 1, 1, -1), servo());
  EXPECT_NE(load.find("load_position turns against motor_position"), std::string::npos) << load;
}

TEST(RecordSense, NamesPositionsInOtherUnits) {
  for (const double times : {0.01, 0.5, 180 / M_PI}) {
    const std::string load = refusal(scaled(good(), 1, 1, times), servo());
    EXPECT_NE(load.find("load_position travels"), std::string::npos) << times << load;
  }
}

// Moved by hand the load crosses the gap, while the motor is held and yields a little.
TEST(RecordSense, LeavesALoadThatIsMovedByHandAlone) {
  Columns c = scaled(good(), 0, 2e-5, 1e-3);
  EXPECT_EQ(refusal(c, servo()), "");
}

TEST(RecordSense, NamesTimeInMilliseconds) {
  const std::string time = refusal(good(), servo(), 1000 * kInterval);
  EXPECT_NE(time.find("time is not in seconds"), std::string::npos) << time;
}

TEST(RecordSense, ALockedLinkIsNotAsked) {
  model::Rig locked = servo();
  locked.link_locked = true;
  EXPECT_EQ(refusal(scaled(good(), -1, 1, -1), locked), "");
}

TEST(RecordSense, NamesTheUnitBehindAnInertiaOfAnotherSize) {
  EXPECT_TRUE(findings(good(), servo()).empty());
  EXPECT_TRUE(findings(moved(3 * all(), 20, 60), servo()).empty());
  EXPECT_TRUE(findings(moved(0.02 * all(), 200, 600), servo()).empty());  // friction takes nearly all
  Columns driver = moved(servo().motor.inertia, 0.2, 0.6);  // by itself, with and without the other encoder
  driver.load.assign(driver.motor.size(), 0.3);
  EXPECT_TRUE(findings(driver, servo()).empty());
  driver.load.clear();
  EXPECT_TRUE(findings(driver, servo()).empty());
  const double degrees = 180 / M_PI;
  const std::string in_degrees = refusal(scaled(good(), 1, degrees, degrees), servo());
  EXPECT_NE(in_degrees.find("0.0175 times"), std::string::npos) << in_degrees;
  EXPECT_NE(in_degrees.find("degrees"), std::string::npos) << in_degrees;
  EXPECT_NE(refusal(scaled(good(), 1000, 1, 1), servo()).find("N mm"), std::string::npos);
  const auto odd = findings(scaled(good(), 13, 1, 1), servo());  // no unit is 13 times another
  ASSERT_EQ(odd.size(), 1u);
  EXPECT_EQ(odd[0].kind, record::FindingKind::scale);
  EXPECT_EQ(odd[0].consequence, record::Consequence::noted);
}

// The load is driven by the motor: with the columns exchanged it would run ahead of what drives it.
TEST(RecordSense, NamesColumnsInEachOthersPlace) {
  Columns c = good();
  std::swap(c.motor, c.load);
  EXPECT_NE(refusal(c, servo()).find("in each other's place"), std::string::npos) << refusal(c, servo());
  c = good();
  std::swap(c.motor, c.torque);
  c.load.clear();
  EXPECT_NE(refusal(c, servo()).find("in each other's place"), std::string::npos) << refusal(c, servo());
}

// A model's gravity in place of what was measured: no friction, no inertia.
TEST(RecordSense, NamesATorqueOfThePositionAlone) {
  const Columns c = moved(0, 0, 0, 300);
  EXPECT_NE(refusal(c, servo()).find("function of motor_position alone"), std::string::npos)
      << refusal(c, servo());
  EXPECT_EQ(refusal(moved(0, 0, 30, 300), servo()), "");
}

}  // namespace
}  // namespace backlash::rig_file
