// SPDX-License-Identifier: BSD-3-Clause
// Sticking and sliding of both ends of a gear train, against a time-stepping of its own, closed forms and
// energy.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/simulation/plant.h"
#include "support/dry_friction.h"
#include "support/rigs.h"

namespace backlash::simulation::dry_friction {
namespace {

/// Two inertias with backlash and dry friction in steps of `step` [s]: Heun, a speed that changes its sign
/// stops at zero, and a resting body moves where its friction is too small to hold it.
class TimeStepping {
 public:
  TimeStepping(const model::Rig& rig, std::function<double(double)> torque, double step)
      : body_{rig.motor, rig.link}, half_(0.5 * rig.mesh.backlash), torque_(std::move(torque)), step_(step) {}

  void advance_to(double t) {
    for (; time_ < t - 0.5 * step_; time_ = ++count_ * step_) {
      double a[2], b[2], q[2], w[2];
      accelerations(time_, q_, w_, a);
      for (int i = 0; i < 2; ++i) q[i] = q_[i] + step_ * w_[i], w[i] = stopped(w_[i], w_[i] + step_ * a[i]);
      accelerations(time_ + step_, q, w, b);
      for (int i = 0; i < 2; ++i) {
        const double next = stopped(w_[i], w_[i] + 0.5 * step_ * (a[i] + b[i]));
        q_[i] += 0.5 * step_ * (w_[i] + next);
        w_[i] = next;
      }
    }
  }
  double position(int body) const { return q_[body]; }

 private:
  static double stopped(double before, double after) { return before * after < 0 ? 0 : after; }

  void accelerations(double t, const double* q, const double* w, double* a) const {
    const double x = q[0] - q[1], depth = std::fabs(x) - half_, side = x > 0 ? 1 : -1;
    double force = 0;
    if (depth > 0) force = std::max(0.0, 460e3 * depth + 483 * side * (w[0] - w[1])) * side;
    const double net[2] = {torque_(t) - force, force};
    for (int i = 0; i < 2; ++i) {
      const model::Body& b = body_[i];
      const double drag = b.viscous_damping * w[i] + b.viscous_asymmetry * std::fabs(w[i]);
      const double forward = b.coulomb_friction + b.coulomb_asymmetry,
                   backward = b.coulomb_friction - b.coulomb_asymmetry;
      double sum = net[i] - drag;
      if (w[i] > 0 || (w[i] == 0 && sum > forward))
        sum -= forward;
      else if (w[i] < 0 || (w[i] == 0 && sum < -backward))
        sum += backward;
      else
        sum = 0;
      a[i] = sum / b.inertia;
    }
  }

  double q_[2] = {0, 0}, w_[2] = {0, 0};
  model::Body body_[2];
  double half_;
  std::function<double(double)> torque_;
  double step_, time_ = 0;
  long count_ = 0;
};

TEST(DryFrictionOfTrains, TwoInertiasWithBacklashAgreeWithATimeStepping) {
  const double amplitude = 400, frequency = 4;
  const model::Rig rig = servo();
  const auto torque = [=](double t) { return amplitude * std::sin(2 * M_PI * frequency * t); };
  Plant plant(rig, sine(amplitude, frequency), test::solver(1e-9));
  TimeStepping oracle(rig, torque, 1e-6);
  double travel = 0, error = 0, twist = 0, twist_error = 0;
  int both_moving = 0, one_stuck = 0, both_stuck = 0;
  for (int k = 1; k <= 500; ++k) {
    plant.advance_to(k * 1e-3);
    oracle.advance_to(k * 1e-3);
    const auto& s = plant.state();
    travel = std::max(travel, std::fabs(oracle.position(0)));
    error = std::max(error, std::fabs(s[0] - oracle.position(0)));
    twist = std::max(twist, std::fabs(oracle.position(0) - oracle.position(1)));
    twist_error = std::max(twist_error, std::fabs(s[0] - s[1] - oracle.position(0) + oracle.position(1)));
    (s[2] != 0 && s[3] != 0 ? both_moving : s[2] == 0 && s[3] == 0 ? both_stuck : one_stuck)++;
  }
  EXPECT_GT(both_moving, 100);
  EXPECT_GT(one_stuck, 10);
  // events of the oracle are late by up to its step, 1e-6 of a period of 0.25 s and of a ring time of 4e-3 s
  EXPECT_LT(error, 1e-4 * travel);
  EXPECT_LT(twist_error, 1e-3 * twist);
}

/// Integrals over the motion of a train, by the trapezoidal rule in `rate` steps per second.
struct Balance {
  double work = 0, lost = 0, change = 0;
};

Balance balance_of(Plant& plant, const model::Rig& rig, double duration, double rate, int link,
                   const std::function<double(const Plant&)>& inner_loss) {
  Balance sum;
  const auto powers = [&](double& in, double& out) {
    const auto& s = plant.state();
    const int n = plant.gear_train().dof();
    const auto rub = [](const model::Body& b, double w) {
      return std::fabs(w) *
             (w > 0 ? b.coulomb_friction + b.coulomb_asymmetry : b.coulomb_friction - b.coulomb_asymmetry);
    };
    in = plant.motor_torque() * s[n];
    out = rub(rig.motor, s[n]) + plant.gear_train().damping_power(s.data()) + inner_loss(plant);
    if (link >= 0) out += rub(rig.link, s[n + link]);
  };
  const double before = plant.gear_train().energy(plant.state().data());
  double in0, out0, in1, out1;
  powers(in0, out0);
  for (long k = 1; k <= std::lround(duration * rate); ++k) {
    plant.advance_to(k / rate);
    powers(in1, out1);
    sum.work += 0.5 * (in0 + in1) / rate;
    sum.lost += 0.5 * (out0 + out1) / rate;
    in0 = in1, out0 = out1;
  }
  sum.change = plant.gear_train().energy(plant.state().data()) - before;
  return sum;
}

// Work of the motor = change of energy + losses. Rigid couplings, then a flexible input coupling.
TEST(DryFrictionOfTrains, EnergyIsNeitherMadeNorLost) {
  for (bool flexible : {false, true}) {
    model::Rig rig = servo();
    rig.mesh.contact = linear(460e3, 0);  // its damping would have to be integrated too
    if (flexible) {
      rig.input_coupling = {false, 50e3, 20, 0};
      rig.pinion.inertia = 2;
    }
    Plant plant(rig, sine(300, 3), test::solver(1e-9));
    const Balance sum = balance_of(plant, rig, 1, 20000, flexible ? 2 : 1, [](const Plant&) { return 0.0; });
    EXPECT_GT(sum.work, 0.1) << "J";
    // rule: (h w)^2 / 12 of a ringing with w = 280 rad/s is 2e-5; and a kink at each stop, h of its power
    EXPECT_NEAR(sum.work, sum.change + sum.lost, 1e-4 * sum.work) << flexible;
  }
}

TEST(DryFrictionOfTrains, TheLoadMovesWhileTheMotorSticks) {
  model::Rig rig = servo();
  rig.motor.coulomb_friction = 500;  // more than an impact
  Plant plant(rig, at_load(sine(40, 2)), test::solver(1e-8));
  double most = 0, least = 0;
  for (int k = 1; k <= 3000; ++k) {
    plant.advance_to(k * 1e-3);
    ASSERT_EQ(plant.state()[0], 0);
    ASSERT_EQ(plant.state()[2], 0);
    most = std::max(most, plant.state()[1]), least = std::min(least, plant.state()[1]);
  }
  EXPECT_GT(most, 2.7e-4) << "it reaches the wall";
  EXPECT_LT(least, -2.7e-4);
}

TEST(DryFrictionOfTrains, TheMotorMovesWhileTheLoadSticks) {
  model::Rig rig = servo();
  rig.link.coulomb_friction = 400;
  Plant plant(rig, sine(150, 2), test::solver(1e-8));
  double most = 0, least = 0;
  for (int k = 1; k <= 3000; ++k) {
    plant.advance_to(k * 1e-3);
    ASSERT_EQ(plant.state()[1], 0);
    ASSERT_EQ(plant.state()[3], 0);
    most = std::max(most, plant.state()[0]), least = std::min(least, plant.state()[0]);
  }
  EXPECT_GT(most, 2.7e-4 + 80 / 460e3);  // 150 - 67 N m is left for the teeth, and more for the impact
  EXPECT_LT(least, -2.7e-4 - 80 / 460e3);
}

TEST(DryFrictionOfTrains, ABrakeHoldsToTheBit) {
  for (const std::string& method : integrator_methods()) {
    Plant plant(servo(), braked(at_load(sine(5000, 5))), test::solver(1e-6, method));
    put(plant, {0.7654321, 0.7654321, 0.3, 0.05});
    for (int k = 0; k <= 2000; ++k) {
      plant.advance_to(k * 1e-3);
      ASSERT_EQ(plant.state()[0], 0.7654321) << method;
      ASSERT_EQ(plant.state()[2], 0) << method;
    }
    EXPECT_NE(plant.state()[3], 0);
  }
}

std::shared_ptr<const model::ContactLaw> rigid(double restitution) {
  return model::make_contact_law(
      "stereomechanical",
      {{"restitution", restitution}, {"resting_speed", 1e-6}, {"stiffness", 460e3}, {"damping", 483}});
}

TEST(DryFrictionOfTrains, AgainstABrakedMotorTheLoadBouncesAsFromAWall) {
  model::Rig rig = servo();
  rig.link = {108};
  rig.mesh.contact = rigid(0.5);
  for (const std::string& method : integrator_methods()) {
    Plant plant(rig, braked(test::constant(0)), test::solver(1e-9, method));
    put(plant, {0.2, 0.2, 0, 0.05});
    double t = 2.7e-4 / 0.05, speed = 0.05;
    for (int bounce = 0; bounce < 4; ++bounce) {
      speed *= -0.5;
      plant.advance_to(t + 1e-4);
      EXPECT_NEAR(plant.state()[3], speed, 1e-12) << method << ", " << bounce;  // straight flight: roundings
      t += 5.4e-4 / std::fabs(speed);
    }
    EXPECT_EQ(plant.state()[0], 0.2);
    EXPECT_EQ(plant.state()[2], 0);
  }
}

// Two bodies: a stuck one is hit, takes its share of the momentum and slides until friction stops it.
TEST(DryFrictionOfTrains, AnImpactSetsAStuckBodyInMotion) {
  const double first = 2, second = 5, e = 0.6, v = 0.4, friction = 30, gap = 1e-2;
  for (const std::string& method : integrator_methods())
    for (int sign : {1, -1}) {
      model::Rig rig;
      rig.motor.inertia = first;
      rig.link = {second, 0, 0, friction, 0};
      rig.mesh.backlash = 2 * gap;
      rig.mesh.contact = rigid(e);
      Plant plant(rig, test::constant(0), test::solver(1e-9, method));
      put(plant, {0.3, 0.3, sign * v, 0});
      const double touch = gap / v;
      plant.advance_to(touch - 1e-4);
      EXPECT_EQ(plant.state()[1], 0.3);
      const double after1 = (first - e * second) / (first + second) * v,
                   after2 = first * (1 + e) / (first + second) * v;
      plant.advance_to(touch + 1e-4);
      EXPECT_NEAR(plant.state()[2], sign * after1, 1e-9);
      EXPECT_NEAR(plant.state()[3], sign * (after2 - 1e-4 * friction / second), 1e-9) << method;
      const double slide = after2 * second / friction, way = 0.5 * after2 * slide;
      ASSERT_LT(way - after1 * slide, 2 * gap) << "the other flank would touch first";
      plant.advance_to(touch + slide + 1e-6);
      EXPECT_EQ(plant.state()[3], 0) << method;
      EXPECT_NEAR(plant.state()[1], 0.3 + sign * way, 1e-9) << method;  // roundings of touch and stop
    }
}

/// Friction of a term on top of, or instead of, that of the bodies.
class Rubbing : public model::Term {
 public:
  explicit Rubbing(double constant, double per_torque = 0) : constant_(constant), per_torque_(per_torque) {}
  bool has_dry_friction() const override { return true; }
  void add_friction(const model::Motion& m, model::EndFriction& f) const override {
    const double more = constant_ + per_torque_ * std::fabs(m.mesh_torque);
    f.motor.forward += more, f.motor.backward += more;
  }

 private:
  double constant_, per_torque_;
};

TEST(DryFrictionOfTrains, ATermWithoutFrictionChangesNothing) {
  for (double limit : {0.0, -3.0}) {  // a negative limit is none
    model::Rig rig = block({2, 0, 0, 0, 0});
    rig.terms = {std::make_shared<Rubbing>(limit)};
    Plant plant(rig, sine(5, 1), test::solver(1e-9));
    EXPECT_EQ(plant.gear_train().friction_event_count(), 1);
    put(plant, {0, -5 / (2 * M_PI * 2)});  // pure sine: q = -A / (J w^2) sin(w t)
    for (int k = 1; k <= 500; ++k) {
      plant.advance_to(k * 1e-2);
      ASSERT_NEAR(plant.state()[0], -5 / (2 * std::pow(2 * M_PI, 2)) * std::sin(2 * M_PI * plant.time()),
                  1e-8);
    }
  }
}

// The motor presses against a locked load: friction grows with the torque through the teeth, so the torque at
// which it moves on is larger by 1 + mu, and back again smaller.
TEST(DryFrictionOfTrains, FrictionThatGrowsWithTheTransmittedTorque) {
  model::Rig rig = block({2, 200, 0, 0, 0});
  rig.mesh.backlash = 0;
  rig.mesh.contact = linear(1000, 0);
  rig.terms = {std::make_shared<Rubbing>(0, 0.25)};
  Plant plant(rig, test::topic(), test::solver(1e-9));
  plant.set_torque(10);
  plant.advance_to(5);  // overdamped: it creeps up until k q (1 + mu) = T
  EXPECT_NEAR(1000 * plant.state()[0], 10 / 1.25, 1e-6);
  plant.set_torque(6.1);  // held down to k q (1 - mu) = 6
  const double place = plant.state()[0];
  plant.advance_to(6);
  EXPECT_NEAR(plant.state()[0], place, 1e-9);
  plant.set_torque(3);
  plant.advance_to(11);
  EXPECT_NEAR(1000 * plant.state()[0], 3 / 0.75, 1e-6);
}

TEST(DryFrictionOfTrains, ANewBacklashNeitherMovesNorStopsAnything) {
  Plant plant(servo(), test::topic(), test::solver(1e-9));
  put(plant, {0.25, 0.25, 0, 0});
  plant.set_torque(60);
  for (int k = 1; k <= 20; ++k) {
    plant.set_backlash(1e-3 + k * 1e-5);
    plant.advance_to(k * 0.1);
    ASSERT_EQ(plant.state()[0], 0.25);
  }
  Plant sliding(block({2, 0.5, 0.1, 3, -1}), test::constant(0), test::solver(1e-10));
  put(sliding, {0, 5});
  const double stop = 2 / 0.6 * std::log1p(0.6 * 5 / 2), way = (2 * 5 - 2 * stop) / 0.6;  // as above
  for (int k = 1; k <= 20; ++k) {
    sliding.advance_to(k * stop / 10);
    sliding.set_backlash(1e6 + k);
  }
  EXPECT_NEAR(sliding.state()[0], way, 1e-8 * way);
}

TEST(DryFrictionOfTrains, SamplingDoesNotMatter) {
  for (const auto& law : {linear(460e3, 483), rigid(0.4)}) {
    model::Rig rig = servo();
    rig.mesh.contact = law;
    Plant often(rig, sine(400, 4), test::solver(1e-10)), seldom(rig, sine(400, 4), test::solver(1e-10));
    for (int k = 1; k <= 500; ++k) {
      for (int i = 4; i >= 0; --i) often.advance_to(k * 1e-3 - i * 2e-4);
      seldom.advance_to(k * 1e-3);
      for (int i = 0; i < 4; ++i)  // rad, rad/s; a thousand tolerances, for the impacts multiply an error
        ASSERT_NEAR(often.state()[i], seldom.state()[i], i < 2 ? 1e-9 : 1e-7) << k << ", state " << i;
    }
  }
}

// The same machine, motor values stated at the load side and at the motor shaft.
TEST(DryFrictionOfTrains, EitherSideOfTheReductionIsTheSameMachine) {
  const double n = 110;
  model::Rig load_side = servo(), motor_side = servo();
  load_side.reduction_ratio = motor_side.reduction_ratio = n;
  motor_side.motor_side = true;
  motor_side.motor = {6.3 / n / n, 13 / n / n, 1 / n / n, 63 / n, 4 / n};
  Plant one(load_side, sine(400, 4), test::solver(1e-10)),
      two(motor_side, sine(400 / n, 4), test::solver(1e-10));
  for (int k = 1; k <= 300; ++k) {
    one.advance_to(k * 1e-3);
    two.advance_to(k * 1e-3);
    ASSERT_NEAR(one.state()[0], two.state()[0], 1e-9);
    ASSERT_NEAR(two.observe().motor_position, n * one.observe().motor_position, n * 1e-9);
  }
}

// The gear is held in the gap by its bearing, whose friction the link does not reach: it swings as on a wall.
TEST(DryFrictionOfTrains, ALinkSwingsOnAGearThatItsBearingHolds) {
  model::Rig rig = servo();
  rig.output_coupling = {false, 1e6, 0, 0};
  rig.bearing_at_gear = true;
  rig.gear.inertia = 1;
  rig.link = {108, 0, 0, 15, 0};
  const double amplitude = 0.9 * 15 / 1e6;  // rad
  Plant plant(rig, sine(0, 1), test::solver(1e-10));
  Plant::State state{};  // motor, gear, link; their speeds
  state[2] = amplitude;
  plant.set_state(state);
  const double w = std::sqrt(1e6 / rig.link.inertia);
  for (int k = 1; k <= 100; ++k) {
    plant.advance_to(0.002 * k);
    EXPECT_NEAR(plant.state()[2], amplitude * std::cos(w * 0.002 * k), 1e-6 * amplitude);
    EXPECT_EQ(plant.state()[1], 0);
  }
  EXPECT_EQ(plant.observe().load_position, 0);  // its encoder is there too
}

// A torque sensor between a motor that rubs and a locked link: where all has come to rest the sensor shows
// the torque but for the motor's friction, and nothing at all before the motor moves.
TEST(DryFrictionOfTrains, BehindAFlexibleCouplingTheMotorsFrictionIsMissing) {
  model::Rig rig = servo();
  rig.input_coupling = {false, 50e3, 200, 0};
  rig.pinion.inertia = 2;
  rig.link_locked = true;
  Plant plant(rig, test::topic(), test::solver(1e-8));
  plant.set_torque(66.9);
  plant.advance_to(1);
  EXPECT_EQ(plant.observe().sensor_torque, 0);
  plant.set_torque(300);
  plant.advance_to(10);
  EXPECT_EQ(plant.state()[2], 0);  // the motor has come to rest
  const double torque = plant.observe().sensor_torque;
  EXPECT_GE(torque, 300 - 67);
  EXPECT_LE(torque, 300 + 59);
  const double place = plant.state()[0];
  plant.advance_to(20);
  EXPECT_EQ(plant.state()[0], place);
}

}  // namespace
}  // namespace backlash::simulation::dry_friction
