// SPDX-License-Identifier: BSD-3-Clause
// Bodies under presliding friction in motion, against an integration of Dahl's equation of its own, closed
// forms and the balance of energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/model/presliding.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"
#include "support/servo.h"

namespace backlash::simulation {
namespace {

std::shared_ptr<const model::Term> presliding(const std::string& body, double distance, double damping = 0) {
  ParameterValues values{{"distance", distance}, {"damping", damping}};
  values.set_choice("body", body);
  return model::make_term("presliding", values);
}

constexpr double kInertia = 2, kForward = 6, kBackward = 4;  // kg m^2, N m

/// One body that never meets a wall.
model::Rig block(double distance, double viscous = 0, double damping = 0) {
  model::Rig rig;
  rig.motor = {kInertia, viscous, 0, 0.5 * (kForward + kBackward), 0.5 * (kForward - kBackward)};
  rig.link_locked = true;
  rig.mesh.backlash = 1e6;
  rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", 1}, {"damping", 0}});
  rig.terms = {presliding("motor", distance, damping)};
  return rig;
}

ExcitationSettings sine(double amplitude, double frequency) {
  ExcitationSettings settings;
  settings.type = "sine";
  settings.amplitude = amplitude;
  settings.frequency = frequency;
  return settings;
}

void put(Plant& plant, double position, double speed) {
  Plant::State state{};
  state[0] = position, state[1] = speed;
  plant.set_state(state);
}

/// The same body with the bristles as a state of its own, dz/dt = w - |w| z / (F_c / sigma_0), friction
/// sigma_0 z + sigma_1 dz/dt (LuGre; Dahl for sigma_1 = 0), sigma_0 = F_c / x_s, classical Runge-Kutta.
struct BristleBody {
  double distance, damping, q = 0, w = 0, f = 0;  // f = sigma_0 z

  void step(double t, double h, double amplitude, double frequency) {
    const auto rate = [&](double time, const double* y, double* dy) {
      const double limit = y[1] > 0 ? kForward : kBackward;
      dy[0] = y[1];
      dy[2] = (y[1] * limit - std::fabs(y[1]) * y[2]) / distance;
      const double friction = y[2] + damping * dy[2] * distance / limit;
      dy[1] = (amplitude * std::sin(2 * M_PI * frequency * time) - friction) / kInertia;
    };
    const double y[] = {q, w, f};
    double k[4][3], at[3];
    rate(t, y, k[0]);
    for (int stage = 1; stage < 4; ++stage) {
      const double part = stage == 3 ? h : 0.5 * h;
      for (int i = 0; i < 3; ++i) at[i] = y[i] + part * k[stage - 1][i];
      rate(t + part, at, k[stage]);
    }
    const auto sum = [&](int i) { return h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]); };
    q += sum(0), w += sum(1), f += sum(2);
  }
};

// Far below, about and above break-away, without damping and with four tenths of the critical one.
void expect_bristles(double damping) {
  const double distance = 0.02, frequency = 1.5, h = 2e-5;
  for (const std::string& method : integrator_methods())
    for (double amplitude : {0.8, 5.5, 9.0}) {
      Plant plant(block(distance, 0, damping), sine(amplitude, frequency), test::solver(1e-9, method));
      BristleBody body{distance, damping};
      double largest = 0, worst = 0;
      for (int k = 0; k < 100'000; ++k) {
        body.step(k * h, h, amplitude, frequency);
        if (k % 500 != 499) continue;
        plant.advance_to((k + 1) * h);
        worst = std::max(worst, std::fabs(plant.state()[0] - body.q));
        largest = std::max(largest, std::fabs(body.q));
      }
      // Both are good to a few 1e-7: the one at some ten kinks by tolerance, the other by the step in which
      // one lies.
      EXPECT_LT(worst, 2e-6 * largest) << method << ", " << amplitude;
      EXPECT_LT(plant.statistics().steps, 20'000) << method << ", " << amplitude;
    }
}

TEST(PreslidingMotion, FollowsDahlsDifferentialEquation) {
  expect_bristles(0);
}

TEST(PreslidingMotion, FollowsLuGresDifferentialEquations) {
  expect_bristles(20);
}

// From rest without load the stiffness is F_c / x_s, and all that oscillates does so at its frequency; the
// loss of a loop falls with the cube of the amplitude.
TEST(PreslidingMotion, SmallOscillationsHaveTheFrequencyOfTheSpring) {
  const double distance = 0.01, w = std::sqrt(5 / distance / kInertia);
  model::Rig rig = block(distance);
  rig.motor.coulomb_asymmetry = 0;
  Plant plant(rig, test::constant(0), test::solver(1e-10));
  const double speed = 1e-4 * distance * w;
  put(plant, 0.3, speed);
  for (int k = 1; k <= 400; ++k) {
    plant.advance_to(k * 0.05 * 2 * M_PI / w);  // 20 periods
    // amplitude 1e-4 x_s: softer by about as much, some 1e-4 of the phase after 120 rad
    ASSERT_NEAR(plant.state()[1] / speed, std::cos(w * plant.time()), 0.02) << k;
  }
}

// A constant torque below the limit is borne: the body comes to rest at x with F(x) = T, having overshot, and
// stays within what it remembers; nothing chatters.
TEST(PreslidingMotion, ATorqueBelowTheLimitIsHeld) {
  for (const std::string& method : integrator_methods()) {
    const double distance = 1e-3, viscous = 40;
    Plant plant(block(distance, viscous), test::constant(3), test::solver(1e-7, method));
    plant.advance_to(60);
    const double place = plant.state()[0];
    EXPECT_NEAR(plant.state()[1], 0, 1e-7) << method;
    EXPECT_GT(place, 0);
    EXPECT_LT(place, -distance * std::log(1 - 3 / kForward) * 3) << method;
    const long steps = plant.statistics().steps;
    plant.advance_to(120);
    EXPECT_NEAR(plant.state()[0], place, 1e-7);
    EXPECT_LT(plant.statistics().steps - steps, 100) << method << ": it sticks";
  }
}

// Pressed into the teeth, from soft to stiff, at coarse and fine tolerances: all comes to rest, at no more
// than a few steps for each swing on the way.
TEST(PreslidingMotion, NothingChatters) {
  for (const std::string& method : integrator_methods())
    for (double distance : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2})
      for (double tolerance : {1e-6, 1e-7}) {
        model::Rig rig = test::other_servo();
        rig.terms = {presliding("motor", distance), presliding("load", 0.3 * distance)};
        ExcitationSettings push = test::constant(30);
        Plant plant(rig, push, test::solver(tolerance, method));
        ASSERT_NO_THROW(plant.advance_to(20)) << method << ", " << distance << ", " << tolerance;
        const double swings =
            (std::sqrt(94 / distance / 7.8) + std::sqrt(36 / (0.3 * distance) / 84)) / M_PI * 20;
        EXPECT_LT(plant.statistics().steps, 20 * swings + 10'000)
            << method << ", " << distance << ", " << tolerance;
      }
}

// Over one cycle of the steady motion the torque does the work that friction takes: no more, no less.
TEST(PreslidingMotion, FrictionOnlyDissipates) {
  const double distance = 0.02, frequency = 1.5;
  for (double amplitude : {2.0, 5.5, 9.0}) {
    Plant plant(block(distance), sine(amplitude, frequency), test::solver(1e-10));
    const double h = 1e-4;
    const auto friction = [&] { return plant.motor_torque() - kInertia * plant.observe().acceleration; };
    double loss = 0, least = 0, work = 0, torque = 0, before = 0, q = 0;
    std::vector<double> losses = {0};
    for (int k = 1; k <= 40'000; ++k) {
      plant.advance_to(k * h);
      const double dq = plant.state()[0] - q, now = friction();
      loss += 0.5 * (before + now) * dq;
      work += 0.5 * (torque + plant.motor_torque()) * dq;
      before = now, torque = plant.motor_torque(), q = plant.state()[0];
      EXPECT_LE(now, kForward + 1e-9);
      EXPECT_GE(now, -kBackward - 1e-9);
      least = std::min(least, loss);
      losses.push_back(loss);
    }
    const double kinetic = 0.5 * kInertia * plant.state()[1] * plant.state()[1];
    EXPECT_NEAR(work, kinetic + loss, 1e-4 * loss) << amplitude;  // trapezia of 1e-4 s
    EXPECT_GE(least, -1e-12) << "it gave back more than it had taken";
    // over whole periods, late: closed but for the creep of a body with two limits
    for (int period = 3; period < 6; ++period)
      EXPECT_GT(losses[std::lround(period / frequency / h)],
                losses[std::lround((period - 1) / frequency / h)]);
  }
}

// Friction gives way over some ten distances x_s, which with a torque that rises by R a second takes
// t = (60 J x_s / R)^(1/3) and leaves a speed off by R t^2 / (2 J): the first slip differs from Coulomb's by
// x_s^(2/3). (Later ones begin with a swing that the stop before has left, and differ more.)
TEST(PreslidingMotion, AVanishingDistanceIsCoulombFriction) {
  model::Rig bare = block(0);
  bare.terms.clear();
  const auto difference = [&](double distance) {
    Plant without(bare, sine(9, 1.5), test::solver(1e-9)),
        with(block(distance), sine(9, 1.5), test::solver(1e-9));
    without.advance_to(0.33);
    with.advance_to(0.33);
    return with.state()[0] - without.state()[0];
  };
  EXPECT_EQ(difference(0), 0);
  const double large = difference(1e-5), small = difference(1e-7);  // of a way of 0.14 rad
  EXPECT_NEAR(std::log10(large / small) / 2, 2.0 / 3, 0.03);  // leading order: relative x_s^(1/3) beside it
  EXPECT_LT(std::fabs(small), 5e-5);
}

TEST(PreslidingMotion, ANewBacklashKeepsTheMemoryAndANewStateForgetsIt) {
  Plant one(block(0.02), sine(5.5, 1.5), test::solver(1e-10)),
      two(block(0.02), sine(5.5, 1.5), test::solver(1e-10));
  for (int k = 1; k <= 200; ++k) {
    one.advance_to(k * 1e-2);
    two.advance_to(k * 1e-2);
    two.set_backlash(1e6 + k);
    ASSERT_NEAR(one.state()[0], two.state()[0], 1e-8);
  }
  const model::Observation moving = one.observe();
  put(one, one.state()[0], one.state()[1]);
  EXPECT_NEAR(one.observe().acceleration, one.motor_torque() / kInertia, 1e-12);
  EXPECT_GT(std::fabs(moving.acceleration - one.observe().acceleration), 0.1);
}

TEST(PreslidingMotion, ABrakedMotorDoesNotGiveWay) {
  model::Rig rig = test::other_servo();
  rig.terms = {presliding("motor", 1e-3)};
  ExcitationSettings excitation = sine(300, 2);
  excitation.at_load = excitation.motor_brake = true;
  Plant plant(rig, excitation, test::solver(1e-7));
  for (int k = 1; k <= 500; ++k) {
    plant.advance_to(k * 1e-3);
    ASSERT_EQ(plant.state()[0], 0);
  }
  EXPECT_NE(plant.state()[1], 0);
}

/// With a damping of the load's bristles that is small for the shortest distance here.
model::Rig presliding_servo(double motor, double load) {
  model::Rig rig = test::other_servo();
  rig.terms = {presliding("motor", motor, 300), presliding("load", load, 2000)};
  return rig;
}

RecordedMotion motion_of(const record::Record& record) {
  RecordedMotion motion;
  motion.interval = record.sampling_interval();
  motion.motor = &record.column(record::Channel::motor_position);
  motion.motor_rate = &record.column(record::Channel::motor_velocity);
  motion.first_load = record.column(record::Channel::load_position).front();
  motion.first_load_rate = record.column(record::Channel::load_velocity).front();
  return motion;
}

TEST(PreslidingMotion, TheDrivenLoadRepeatsTheWholeTrain) {
  for (double distance : {3e-5, 3e-4, 3e-3}) {
    const model::Rig rig = presliding_servo(1e-4, distance);
    const record::Record record = simulate_record(rig, test::servo_run(3, false), 5);
    const DrivenLoad driven = simulate_driven_load(rig, motion_of(record));
    const MotorTorques motor = motor_torques(rig, motion_of(record), driven);
    model::Rig other = rig;
    other.terms = {presliding("motor", 1e-4, 300)};
    const DrivenLoad without = simulate_driven_load(other, motion_of(record));
    double worst = 0, wrong = 0;
    for (std::size_t k = 0; k < record.size(); ++k) {
      const double truth = record.column(record::Channel::load_position)[k];
      worst = std::max(worst, std::fabs(driven.load[k] - truth));
      wrong = std::max(wrong, std::fabs(without.load[k] - truth));
      ASSERT_EQ(motor.friction[k].presliding, 1e-4);
    }
    const double limit = 3e-5;  // rad, as without presliding: impacts within a sample
    EXPECT_LT(worst, limit) << distance;
    // Held fast instead, a load that rests is off by what its friction gives way: about its distance.
    EXPECT_GT(wrong, std::max(2 * limit, 0.5 * distance)) << distance;
  }
}

// The motor's friction from the record of its motion, beside that which the simulation had.
TEST(PreslidingMotion, FrictionAlongARecordIsThatOfTheSimulation) {
  for (double distance : {1e-4, 1e-3}) {
    const model::Rig rig = presliding_servo(distance, 1e-3);
    const SimulationSettings settings = test::servo_run(5, false);
    Simulation simulation(rig, settings);
    std::vector<double> position, rate, friction;
    const model::GearTrain train(rig);
    for (int k = 0; k < 4000; ++k) {
      const model::Observation o = simulation.step();
      const Plant& plant = simulation.plant();
      double rates[model::GearTrain::kMaxStates];
      plant.gear_train().derivative(plant.time(), plant.state().data(), plant.applied_torque(), rates);
      const double net = train.end_forces(plant.time(), plant.state().data(), plant.applied_torque()).motor;
      position.push_back(o.motor_position);
      rate.push_back(o.motor_velocity);
      friction.push_back(net - train.motor_inertia() * rates[2]);
    }
    const model::FrictionLimits limits{47, 47, distance, 300};
    const auto found =
        model::presliding_friction(position, std::vector<model::FrictionLimits>(position.size(), limits),
                                   rate, 1 / simulation.sampling_rate());
    double worst = 0, square = 0;
    for (std::size_t k = 0; k < found.size(); ++k) {
      worst = std::max(worst, std::fabs(found[k] - friction[k]));
      square += std::pow(found[k] - friction[k], 2) / found.size();
    }
    // Of 47 N m. Samples beside a turn are off most: the turn lies somewhere between them.
    EXPECT_LT(std::sqrt(square), 0.1) << distance;
    EXPECT_LT(worst, 2) << distance;
  }
}

}  // namespace
}  // namespace backlash::simulation
