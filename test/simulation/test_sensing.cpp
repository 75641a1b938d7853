// SPDX-License-Identifier: BSD-3-Clause
// Terms that change what sensors show: the scale of the load encoder, the delay of the torque.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/simulation/simulation.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

constexpr double kInertia = 2, kAmplitude = 3, kFrequency = 4;  // kg m^2, N m, Hz

/// One free body under a sine torque from rest: J q = -A / w^2 sin(w t) + A / w t.
struct FreeBody {
  double w = 2 * M_PI * kFrequency, a = kAmplitude / kInertia;
  double torque(double t) const { return t < 0 ? 0 : kAmplitude * std::sin(w * t); }
  double position(double t) const { return t < 0 ? 0 : a / w * (t - std::sin(w * t) / w); }
  double velocity(double t) const { return t < 0 ? 0 : a / w * (1 - std::cos(w * t)); }
  double acceleration(double t) const { return t < 0 ? 0 : a * std::sin(w * t); }
};

model::Rig free_body(std::vector<std::shared_ptr<const model::Term>> terms) {
  model::Rig rig;
  rig.motor.inertia = kInertia / 2;
  rig.link.inertia = kInertia / 2;
  rig.mesh.rigid = true;
  rig.torque_constant = 0.5;
  rig.terms = std::move(terms);
  return rig;
}

SimulationSettings run_settings() {
  SimulationSettings settings;
  settings.excitation.type = "sine";
  settings.excitation.amplitude = kAmplitude;
  settings.excitation.frequency = kFrequency;
  settings.solver = test::solver(1e-10);
  settings.sensors.of(record::Channel::acceleration).declared = true;
  settings.sensors.of(record::Channel::motor_current).declared = true;
  return settings;
}

std::shared_ptr<const model::Term> delay(double d) {
  return model::make_term("delay", {{"delay", d}});
}

std::shared_ptr<const model::Term> encoder_scale(double s) {
  return model::make_term("encoder_scale", {{"scale", s}});
}

// Whole and broken parts of the interval of 1 ms, one that is off a whole number by a rounding, and none.
TEST(Sensing, ADelayShiftsMotionAgainstTorque) {
  const FreeBody body;
  for (double d : {0.4e-3, 1e-3, 3 * (1e-3 + 1e-18), 2.7e-3, -0.4e-3, -1e-3, -3.3e-3, 1e-19, -1e-19, 0.0}) {
    Simulation simulation(free_body({delay(d)}), run_settings());
    for (int twice = 0; twice < 2; ++twice, simulation.reset())
      for (int k = 0; k < 500; ++k) {
        const double t = k / 1000.0, motion = t - std::max(0.0, d), drive = t - std::max(0.0, -d);
        const model::Observation o = simulation.step();
        ASSERT_NEAR(o.motor_torque, body.torque(drive), 1e-12) << d << ", " << k;  // roundings of w t
        ASSERT_NEAR(o.motor_current, 2 * body.torque(drive), 1e-12);
        ASSERT_NEAR(o.motor_position, body.position(motion), 1e-9);  // ten tolerances
        ASSERT_NEAR(o.load_position, body.position(motion), 1e-9);
        ASSERT_NEAR(o.motor_velocity, body.velocity(motion), 1e-9);
        ASSERT_NEAR(o.load_velocity, body.velocity(motion), 1e-9);
        ASSERT_NEAR(o.acceleration, body.acceleration(motion), 1e-12);
      }
  }
}

// The phase of the fundamental, by correlation over whole periods of the velocity, which is that of the
// position plus a quarter turn.
TEST(Sensing, ThePhaseMovesByTheAngleOfTheDelay) {
  const double w = 2 * M_PI * kFrequency;
  const auto phase = [&](double d) {
    const record::Record record = simulate_record(free_body({delay(d)}), run_settings(), 2);
    double in = 0, out = 0, in_torque = 0, out_torque = 0;
    for (std::size_t k = 1000; k < 2000; ++k) {
      const double s = std::sin(w * record.time[k]), c = std::cos(w * record.time[k]);
      in += record.column(record::Channel::motor_velocity)[k] * s,
          out += record.column(record::Channel::motor_velocity)[k] * c;
      in_torque += record.column(record::Channel::motor_torque)[k] * s;
      out_torque += record.column(record::Channel::motor_torque)[k] * c;
    }
    return std::atan2(out, in) - std::atan2(out_torque, in_torque);
  };
  const double without = phase(0);
  EXPECT_NEAR(std::remainder(without, 2 * M_PI), -M_PI / 2, 1e-8);  // speed lags torque
  for (double d : {0.3e-3, 2e-3, 12.7e-3, -0.3e-3, -5.1e-3})
    EXPECT_NEAR(std::remainder(phase(d) - without + w * d, 2 * M_PI), 0, 1e-8)
        << d;  // tolerance of the motion
}

// The oracle is the closed form at the moments that motor and load show.
TEST(Sensing, ALoadEncoderMayBeLateOrEarlyBesideADelayOfTheTorque) {
  const FreeBody body;
  for (const double skew : {2e-3, 0.7e-3, -1.6e-3})
    for (const double d : {0.0, 1.2e-3, -0.5e-3}) {
      model::Rig rig = free_body({});
      if (d != 0) rig.terms = {delay(d)};
      rig.encoder_skew = skew;
      const record::Record record = simulate_record(rig, run_settings(), 0.2);
      const double latest = std::min({0.0, d, d + skew});
      for (int k = 0; k < 200; ++k) {
        const double t = 1e-3 * k + latest;
        ASSERT_NEAR(record.column(record::Channel::motor_torque)[k], body.torque(t), 1e-9) << k;
        ASSERT_NEAR(record.column(record::Channel::motor_position)[k], body.position(t - d), 1e-9) << k;
        ASSERT_NEAR(record.column(record::Channel::load_position)[k], body.position(t - d - skew), 1e-9) << k;
        ASSERT_NEAR(record.column(record::Channel::load_velocity)[k], body.velocity(t - d - skew), 1e-9) << k;
      }
    }
}

TEST(Sensing, ATorqueThatJumpsShowsItsJumpLate) {
  SimulationSettings settings = run_settings();
  settings.excitation = test::square(2, 5);
  for (double d : {-1.5e-3, 1.5e-3}) {
    const record::Record record = simulate_record(free_body({delay(d)}), settings, 0.3);
    for (int k = 0; k < 300; ++k) {
      const double t = k / 1000.0 - std::max(0.0, -d), v = k / 1000.0 - std::max(0.0, d);
      const double torque = t < 0 ? 0 : std::fmod(t, 0.2) < 0.1 - 1e-9 ? 2 : -2;
      ASSERT_EQ(record.column(record::Channel::motor_torque)[k], torque) << k;
      const double phase = std::fmod(std::max(0.0, v), 0.2);
      ASSERT_NEAR(record.column(record::Channel::motor_velocity)[k], phase < 0.1 ? phase : 0.2 - phase, 1e-9)
          << k;
    }
  }
}

TEST(Sensing, OpposedDelaysCancel) {
  const record::Record one = simulate_record(free_body({delay(2e-3), delay(-2e-3)}), run_settings(), 0.1);
  const record::Record two = simulate_record(free_body({}), run_settings(), 0.1);
  for (record::Channel channel : record::kChannels)
    EXPECT_EQ(one.column(channel), two.column(channel)) << record::channel_name(channel);
}

TEST(Sensing, TheLoadEncoderShowsItsScale) {
  const record::Record wrong =
      simulate_record(free_body({encoder_scale(0.02), encoder_scale(-0.3)}), run_settings(), 0.1);
  const record::Record right = simulate_record(free_body({}), run_settings(), 0.1);
  for (record::Channel channel : record::kChannels)
    for (std::size_t k = 0; k < right.column(channel).size(); ++k) {
      const bool scaled =
          channel == record::Channel::load_position || channel == record::Channel::load_velocity;
      const double shown = right.column(channel)[k] * (scaled ? 1.02 * 0.7 : 1);
      EXPECT_DOUBLE_EQ(wrong.column(channel)[k], shown) << record::channel_name(channel) << ", " << k;
    }
  EXPECT_GT(right.column(record::Channel::load_position).back(), 0.004);
}

TEST(Sensing, TermsAddUp) {
  const model::Sensing sum =
      model::sensing({delay(1e-3), encoder_scale(0.5), delay(-4e-3), encoder_scale(0.1),
                      model::make_term("gravity", {{"amplitude", 1}, {"phase", 0}})});
  EXPECT_DOUBLE_EQ(sum.torque_delay, -3e-3);
  EXPECT_DOUBLE_EQ(sum.load_position_gain, 1.65);
  EXPECT_EQ(model::sensing({}).load_position_gain, 1);
  EXPECT_EQ(model::sensing({}).torque_delay, 0);
  EXPECT_THROW(delay(1.01), InvalidParameter);
  EXPECT_THROW(encoder_scale(-0.6), InvalidParameter);
}

// At their typical strength the effects are as large as what the record shows anyway.
TEST(Sensing, TheSearchKnowsAStrength) {
  model::MotionRange range;
  range.deflection = 4e-4, range.from = -0.3, range.to = 0.5, range.interval = 2e-3;
  for (const std::string& id : {std::string("encoder_scale"), std::string("delay")}) {
    const model::TermType& type = model::term_type(id);
    ASSERT_TRUE(type.search) << id;
    EXPECT_EQ(type.search->strength, type.parameters.front().name);
    EXPECT_DOUBLE_EQ(type.search->typical(range), std::string(id) == "delay" ? 2e-3 : 5e-4);
    EXPECT_GT(type.search->typical({}), id == std::string("delay") ? -1 : 0);
    EXPECT_FALSE(model::make_term(id, {{type.search->strength, 0}})->moves_load());
  }
}

}  // namespace
}  // namespace backlash::simulation
