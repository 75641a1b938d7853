// SPDX-License-Identifier: BSD-3-Clause
// Sticking and sliding of one body, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/simulation/plant.h"
#include "support/dry_friction.h"
#include "support/rigs.h"

namespace backlash::simulation::dry_friction {
namespace {

// J w' = -c w - F stops after J/c ln(1 + c w0 / F) at (J w0 - F t) / c.
TEST(DryFriction, ASlidingBodyStopsWhenAndWhereItMust) {
  const double inertia = 2;
  for (const std::string& method : integrator_methods())
    for (int sign : {1, -1}) {
      Plant plant(block({inertia, 0.5, 0.1, 3, -1}), test::constant(0), test::solver(1e-10, method));
      const double c = sign > 0 ? 0.6 : 0.4, f = sign > 0 ? 2 : 4, w0 = 5;
      put(plant, {0, sign * w0});
      const double stop = inertia / c * std::log1p(c * w0 / f), way = (inertia * w0 - f * stop) / c;
      plant.advance_to(stop - 1e-6);
      EXPECT_NEAR(sign * plant.state()[1], 1e-6 * f / inertia, 3e-8) << method;  // a hundred tolerances
      plant.advance_to(stop + 1e-6);
      EXPECT_EQ(plant.state()[1], 0) << method;
      EXPECT_NEAR(plant.state()[0], sign * way, 1e-8 * way) << method;  // a hundred tolerances
      const double place = plant.state()[0];
      for (int k = 1; k <= 1000; ++k) {
        plant.advance_to(stop + 0.1 * k);
        ASSERT_EQ(plant.state()[0], place) << method;
        ASSERT_EQ(plant.state()[1], 0) << method;
      }
    }
}

TEST(DryFriction, BelowBreakAwayNotASingleBitMoves) {
  for (const std::string& method : integrator_methods())
    for (double frequency : {0.3, 77.0}) {
      Plant plant(servo(), sine(58.9, frequency), test::solver(1e-6, method));  // backward limit 59
      const double place = 0.1234567;
      put(plant, {place, place, 0, 0});
      for (int k = 1; k <= 4000; ++k) {
        plant.advance_to(k * 1e-3);
        ASSERT_EQ(plant.state()[0], place) << method << ", " << k;
        ASSERT_EQ(plant.state()[1], place) << method << ", " << k;
        ASSERT_EQ(plant.state()[2], 0);
        ASSERT_EQ(plant.observe().acceleration, 0);
      }
    }
}

/// One slip under A sin(w t) against friction F, by its closed form. For the other direction mirrored.
struct Slip {
  double start, end, way;

  Slip(double inertia, double amplitude, double w, double f) {
    start = std::asin(f / amplitude) / w;
    const auto momentum = [=](double t) {
      return amplitude / w * (std::cos(w * start) - std::cos(w * t)) - f * (t - start);
    };
    end = root(momentum, M_PI / 2 / w, 2 * M_PI / w);
    const double t = end - start;
    way = (amplitude / w * std::cos(w * start) * t -
           amplitude / (w * w) * (std::sin(w * end) - std::sin(w * start)) - 0.5 * f * t * t) /
          inertia;
  }
};

// Between slips the body rests, and each direction has its own friction, so it creeps. Just above break-away
// too, where the torque exceeds the limit for a fiftieth of the period only.
TEST(DryFriction, SineAboveBreakAwaySlipsOnceEachWay) {
  const double inertia = 2, forward = 6, backward = 4, frequency = 2, w = 2 * M_PI * frequency;
  for (const std::string& method : integrator_methods())
    for (double amplitude : {6.006, 7.0}) {
      const Slip forth(inertia, amplitude, w, forward), back(inertia, amplitude, w, backward);
      Plant plant(block({inertia, 0, 0, 5, 1}), sine(amplitude, frequency), test::solver(1e-8, method));
      const int periods = 20;
      int slips = 0;
      bool moving = false;
      for (int k = 1; k <= periods * 1000; ++k) {
        plant.advance_to(k / 2000.0);
        const bool moves = plant.state()[1] != 0;
        slips += moves && !moving;
        moving = moves;
      }
      const double end = periods / frequency + 0.9 / w;  // the last slip is over, the next has not begun
      plant.advance_to(end);
      Plant once(block({inertia, 0, 0, 5, 1}), sine(amplitude, frequency), test::solver(1e-8, method));
      once.advance_to(end);  // nobody looks in between: it must not step over a slip
      EXPECT_EQ(slips, 2 * periods) << method << ", " << amplitude;
      const double creep = forth.way - back.way;  // to a thousand tolerances
      for (const Plant* each : {&plant, &once})
        EXPECT_NEAR(each->state()[0], periods * creep, 1e-5 * std::fabs(periods * creep))
            << method << ", " << amplitude;
    }
}

// A body whose speed swings down by 2 A / (J w) would turn round for a moment; it stops there until the
// torque exceeds friction again, half a period after the start, and starts from zero.
TEST(DryFriction, AShortReversalOfTheSpeedIsAStop) {
  const double inertia = 2, friction = 6, amplitude = 3, frequency = 2, w = 2 * M_PI * frequency;
  const double swing = 2 * amplitude / (inertia * w);
  for (const std::string& method : integrator_methods())
    for (double tolerance : {1e-4, 1e-8}) {
      ExcitationSettings excitation = sine(amplitude, frequency, M_PI);
      excitation.bias = friction;
      Plant plant(block({inertia, 0, 0, friction, 0}), excitation, test::solver(tolerance, method));
      put(plant, {0, swing * (1 - 2e-3)});  // by this share below zero, for 0.09 rad of the period
      plant.advance_to(1 / frequency);
      EXPECT_NEAR(plant.state()[1], swing, 10 * tolerance * swing + 1e-5 * swing)
          << method << ", " << tolerance;
    }
}

TEST(DryFriction, TheTorqueOfBreakAwayItselfMovesNothing) {
  const model::Rig rig = block({2, 0.5, 0, 5, 1});
  for (const std::string& method : integrator_methods())
    for (double limit : {6.0, -4.0}) {
      Plant equal(rig, test::constant(limit), test::solver(1e-8, method));
      put(equal, {0.7, 0});
      equal.advance_to(100);
      EXPECT_EQ(equal.state()[0], 0.7);
      EXPECT_EQ(equal.state()[1], 0);
      Plant above(rig, test::constant(limit * (1 + 1e-6)), test::solver(1e-8, method));
      above.advance_to(1);  // J w' + c w = T
      const double c = 0.5, t = 2 / c, moved = limit * 1e-6 / c * (1 - t * (1 - std::exp(-1 / t)));
      // all of it is below 1e-6 rad/s, where the tolerance is 1e-9 rad/s
      EXPECT_NEAR(above.state()[0], moved, 1e-5 * std::fabs(moved)) << method;
    }
}

// At the peak of the torque, which equals the limit, it is free to move but is never driven. Sliding there
// for good, friction would push it backwards.
TEST(DryFriction, ATorqueThatTouchesTheLimitAndFallsLetsItStick) {
  for (const std::string& method : integrator_methods())
    for (double phase : {M_PI / 2, -M_PI / 2}) {
      Plant plant(block({2, 0, 0, 5, 0}), sine(5, 3, phase), test::solver(1e-8, method));
      for (int k = 1; k <= 2000; ++k) {
        plant.advance_to(k * 1e-3);
        ASSERT_NEAR(plant.state()[0], 0, 1e-12) << method << ", " << k;  // position tolerance
      }
      EXPECT_TRUE(plant.gear_train().any_stuck());
    }
}

// Square torque against Coulomb friction: parabolas, written out for a period.
TEST(DryFriction, ATorqueThatJumpsThroughZeroTurnsItRound) {
  const double inertia = 2, torque = 10, forward = 6, backward = 4, half = 0.5;
  for (const std::string& method : integrator_methods()) {
    Plant plant(block({inertia, 0, 0, 5, 1}), test::square(torque, 1), test::solver(1e-9, method));
    plant.advance_to(half);
    const double w1 = (torque - forward) / inertia * half, q1 = 0.5 * w1 * half;
    EXPECT_NEAR(plant.state()[1], w1, 1e-8);
    const double brake = (torque + forward) / inertia, stop = w1 / brake, q2 = q1 + 0.5 * w1 * stop;
    plant.advance_to(half + stop);
    EXPECT_NEAR(plant.state()[0], q2, 1e-8);
    plant.advance_to(1);
    const double left = half - stop, w3 = -(torque - backward) / inertia * left, q3 = q2 + 0.5 * w3 * left;
    EXPECT_NEAR(plant.state()[0], q3, 1e-8) << method;  // ten tolerances
    EXPECT_NEAR(plant.state()[1], w3, 1e-8) << method;
  }
}

TEST(DryFriction, ATorqueSetFromOutsideBreaksAwayAtOnce) {
  Plant plant(block({2, 0, 0, 5, 1}), test::topic(), test::solver(1e-9));
  plant.advance_to(1);
  for (double torque : {5.9, -3.9, 0.0}) {
    ASSERT_TRUE(plant.set_torque(torque));
    plant.advance_to(plant.time() + 1);
    EXPECT_EQ(plant.state()[0], 0) << torque;
  }
  plant.set_torque(-10);
  plant.advance_to(plant.time() + 1);
  EXPECT_NEAR(plant.state()[0], -0.5 * 6 / 2, 1e-9);
  plant.set_torque(5.9);  // 9.9 N m against -3 rad/s until it stops for good
  plant.advance_to(plant.time() + 3);
  EXPECT_NEAR(plant.state()[0], -1.5 - 0.5 * 9 * 2 / 9.9, 1e-8);
  EXPECT_EQ(plant.state()[1], 0);
}

// The same closed form in pieces of 10 ms, each with an error of its own: a hundred tolerances.
TEST(DryFriction, ATorqueThatIsKnownToLastMovesItAlike) {
  for (const std::string& method : integrator_methods()) {
    Plant plant(block({2, 0, 0, 5, 1}), test::topic(), test::solver(1e-9, method));
    for (int k = 1; k <= 500; ++k) {
      plant.set_torque(k <= 100 ? -10 : 5.9, 0.01 * k);
      plant.advance_to(0.01 * k);
      if (k == 100) EXPECT_NEAR(plant.state()[0], -0.5 * 6 / 2, 1e-7) << method;
    }
    EXPECT_NEAR(plant.state()[0], -1.5 - 0.5 * 9 * 2 / 9.9, 1e-7) << method;
    EXPECT_EQ(plant.state()[1], 0) << method;
    EXPECT_THROW(plant.advance_to(6), IntegrationError) << method;
  }
}

}  // namespace
}  // namespace backlash::simulation::dry_friction
