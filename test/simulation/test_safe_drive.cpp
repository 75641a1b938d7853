// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/safe_drive.h"

namespace backlash::simulation {
namespace {

constexpr double kStep = 2e-3;  // s

DriveLimits limits() {
  DriveLimits limits;
  limits.torque = 2;
  limits.speed = 3;
  limits.lower = -1.5;
  limits.upper = 1.5;
  limits.duration = 10;
  return limits;
}

ExcitationSettings sine(double amplitude = 1, double frequency = 1) {
  ExcitationSettings excitation;
  excitation.type = "sine";
  excitation.amplitude = amplitude;
  excitation.frequency = frequency;
  return excitation;
}

/// An inertia with viscous friction, and what is wrong with it.
struct Joint {
  double inertia = 0.5, viscous = 1;  // kg m^2, N m s/rad
  double position = 0, velocity = 0;
  void step(double torque) {
    velocity += kStep * (torque - viscous * velocity) / inertia;
    position += kStep * velocity;
  }
};

struct Ran {
  double largest = 0, last = 0, highest_speed = 0, farthest = 0, ended_at = 0;
};

/// `fault(t, torque)`: changes what acts on the joint; `seen(t, position)`: what is shown of it, NaN: no
/// state.
Ran run(SafeDrive& drive, Joint& joint, const std::function<double(double, double)>& fault = nullptr,
        const std::function<std::optional<double>(double, double)>& seen = nullptr) {
  Ran ran;
  drive.start(100);
  for (double t = 0; t < 15; t += kStep) {
    const auto position = seen ? seen(t, joint.position) : std::optional<double>(joint.position);
    if (position) drive.take(100 + t, t, *position, {});
    const double torque = drive.torque(100 + t);
    ran.last = torque;
    ran.largest = std::max(ran.largest, std::abs(torque));
    if (!drive.ended()) ran.ended_at = t;
    joint.step(fault ? fault(t, torque) : torque);
    if (!drive.ended()) {
      ran.highest_speed = std::max(ran.highest_speed, std::abs(joint.velocity));
      ran.farthest = std::max(ran.farthest, std::abs(joint.position));
    }
  }
  return ran;
}

TEST(SafeDrive, ARunIsDrivenToItsEnd) {
  SafeDrive drive(sine(), 4, limits());
  Joint joint;
  const Ran ran = run(drive, joint);
  EXPECT_TRUE(drive.done()) << drive.reason();
  EXPECT_EQ(ran.last, 0);
  EXPECT_NEAR(ran.largest, 1, 1e-3);
  EXPECT_NEAR(ran.ended_at, 4.5, 0.01);  // rest and run
}

void expect_refused(const std::string& name, const ExcitationSettings& excitation, double duration,
                    const DriveLimits& limits) {
  try {
    SafeDrive(excitation, duration, limits);
    FAIL() << name << " was not refused";
  } catch (const InvalidParameter& e) {
    EXPECT_EQ(e.name(), name) << e.what();
  }
}

TEST(SafeDrive, WhatIsMissingOrTooMuchIsRefusedByName) {
  expect_refused("torque_limit", sine(), 4, DriveLimits());
  DriveLimits some = limits();
  some.speed = kNaN;
  expect_refused("speed_limit", sine(), 4, some);
  some = limits();
  some.lower = kNaN;
  expect_refused("position_lower", sine(), 4, some);
  some = limits();
  some.upper = some.lower;
  expect_refused("position_upper", sine(), 4, some);
  some = limits();
  some.duration = kNaN;
  expect_refused("duration_limit", sine(), 4, some);
  expect_refused("run", sine(2.1), 4, limits());
  expect_refused("run", sine(0), 4, limits());
  expect_refused("duration", sine(), 11, limits());
  expect_refused("duration", sine(), 0.9, limits());
  ExcitationSettings other = sine();
  other.at_load = true;
  expect_refused("run", other, 4, limits());
  other.at_load = false;
  other.type = "topic";
  expect_refused("run", other, 4, limits());
}

void expect_stopped(SafeDrive& drive, const std::string& reason, const Ran& ran) {
  EXPECT_TRUE(drive.ended());
  EXPECT_FALSE(drive.done());
  EXPECT_NE(drive.reason().find(reason), std::string::npos) << drive.reason();
  EXPECT_EQ(ran.last, 0);
}

TEST(SafeDrive, EachFaultStopsIt) {
  const auto drive_and_expect =
      [](const std::string& reason, double latest, const std::function<double(double, double)>& fault,
         const std::function<std::optional<double>(double, double)>& seen = nullptr) {
        SafeDrive drive(sine(), 8, limits());
        Joint joint;
        const Ran ran = run(drive, joint, fault, seen);
        expect_stopped(drive, reason, ran);
        EXPECT_LT(ran.ended_at, latest) << reason;
      };
  const auto healthy = [](double, double torque) { return torque; };
  drive_and_expect("no state came", 2.11, healthy,
                   [](double t, double p) { return t < 2 ? std::optional<double>(p) : std::nullopt; });
  drive_and_expect("not a finite", 2.01, healthy, [](double t, double p) { return t < 2 ? p : kNaN; });
  drive_and_expect("jumped", 2.01, healthy, [](double t, double p) { return t < 2 ? p : p + 0.5; });
  drive_and_expect("against the commanded torque", 1.5, [](double, double torque) { return -torque; });
  drive_and_expect("nothing moved", 6, [](double, double) { return 0.0; });
  drive_and_expect("limit", 4, [](double t, double torque) { return t < 2.5 ? torque : torque + 3; });
  drive_and_expect("not at rest", 0.6, [](double, double) { return 1.0; });
}

// Noise is no jump, no speed and no wrong sign; nor is a coarse encoder.
TEST(SafeDrive, ANoisyJointIsDrivenToItsEnd) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 1e-3);
    const double count = seed % 2 ? 2e-3 : 0;
    SafeDrive drive(sine(), 4, limits());
    Joint joint;
    run(drive, joint, nullptr, [&](double, double position) {
      return count > 0 ? count * std::round(position / count) : position + noise(random);
    });
    EXPECT_TRUE(drive.done()) << seed << " " << drive.reason();
  }
}

TEST(SafeDrive, AStopIsForEver) {
  SafeDrive drive(sine(), 4, limits());
  drive.stop("cancelled");
  drive.stop("later");
  drive.start(0);
  EXPECT_EQ(drive.torque(1), 0);
  EXPECT_EQ(drive.reason(), "cancelled");
}

// Whatever the run, the joint and a push from outside: no command above the limit, none after the end, and
// the joint is never beyond the limits while it is driven, but for one step.
TEST(SafeDrive, LimitsHoldForAnyRun) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&random](double a, double b) {
      return std::uniform_real_distribution<double>(a, b)(random);
    };
    ExcitationSettings excitation = sine(draw(0.1, 3), draw(0.2, 5));
    const char* types[] = {"sine", "square", "constant"};
    excitation.type = types[seed % 3];
    excitation.bias = draw(-0.5, 0.5);
    Joint joint;
    joint.inertia = draw(0.05, 2);
    joint.viscous = draw(0, 2);
    try {
      SafeDrive drive(excitation, draw(1, 9), limits());
      const double push = seed % 2 ? draw(-3, 3) : 0, at = draw(1, 5);
      const Ran ran =
          run(drive, joint, [&](double t, double torque) { return t < at ? torque : torque + push; });
      EXPECT_TRUE(drive.ended()) << seed;
      EXPECT_LE(ran.largest, limits().torque) << seed;
      EXPECT_EQ(ran.last, 0) << seed;
      EXPECT_LT(ran.farthest, limits().upper + kStep * 2 * limits().speed) << seed;
      // A speed is seen by positions over 20 ms, in which 6 N m at most speed up the joint.
      EXPECT_LT(ran.highest_speed, limits().speed + 0.024 * 6 / joint.inertia) << seed;
    } catch (const InvalidParameter& e) {
      EXPECT_EQ(e.name(), "run") << seed << " " << e.what();
    }
  }
}

}  // namespace
}  // namespace backlash::simulation
