// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/position_difference.h"
#include "support/led_servo.h"

namespace backlash::diagnosis {
namespace {

constexpr double kStiffness = 4e5;   // N m/rad
constexpr double kMotorInertia = 6;  // kg m^2
constexpr double kGap = 5e-4;        // rad

using Servo = test::LedServo;

PositionDifferenceSettings settings(const Servo& servo = Servo()) {
  PositionDifferenceSettings s;
  s.elastic_deflection = [](double torque) { return torque / kStiffness; };
  s.motor_inertia = kMotorInertia;
  s.load_inertia = servo.load_inertia;
  s.load_friction = servo.load_coulomb;
  return s;
}

// Left in, 1 ms hides a play of 5e-4 rad at the speeds of this load.
TEST(PositionDifference, ALoadEncoderThatIsLateIsNoPlay) {
  for (const double skew : {-3e-3, 2e-4, 1e-3, 5e-3})
    for (const double gap : {1e-4, 5e-4, 2e-3})
      for (const double declared : {0.0, skew}) {
        Servo servo;
        servo.gap = gap;
        servo.skew = skew;
        PositionDifferenceSettings s = settings();
        s.encoder_skew = declared;
        const Estimate e = estimate_position_difference(servo.record(), s);
        if (e.status != Status::ok) continue;  // an honest answer
        EXPECT_LE(e.angle_lower, gap) << skew << " " << declared << e.message;
        EXPECT_GE(e.angle_upper, gap) << skew << " " << declared << e.message;
        EXPECT_LT(e.angle_upper - e.angle_lower, 1e-4) << e.message;
      }
}

// 1 urad, an eighth of the step of the load encoder: errors of the rounding average out over thousands of
// windows.
constexpr double kNear = 1e-6;

TEST(PositionDifference, FreePlayOfAServoWhoseLoadMoves) {
  for (const double gap : {0.0, 1e-4, 5e-4, 2e-3}) {
    Servo servo;
    servo.gap = gap;
    const Estimate e = estimate_position_difference(servo.record(), settings());
    ASSERT_EQ(e.status, Status::ok) << e.message;
    EXPECT_NEAR(e.backlash_angle, gap, kNear);
    EXPECT_LE(e.angle_lower, gap);
    EXPECT_GE(e.angle_upper, gap);
    // 1 % to either side for the model; teeth that are not quite a spring are not ruled out: 6 % of what they
    // yield under 340 N m
    EXPECT_LT(e.angle_upper - e.angle_lower, 0.06 * 340 / kStiffness + 0.022 * gap);
    EXPECT_TRUE(std::isnan(e.backlash));
    EXPECT_EQ(e.method, "position_difference");
  }
}

// Noise of a regressor draws its coefficient towards 0, here the compliance, and the play follows: without
// looking at the load's motion these records give it 3 to 8 % wrong. 1 % is declared to either side.
TEST(PositionDifference, NoiseOfTheTorqueIsNoPlay) {
  for (const double gap : {2e-4, 5e-4})
    for (const double noise : {30.0, 60.0, 120.0}) {  // N m, of about 150
      Servo servo;
      servo.gap = gap;
      servo.torque_noise = noise;
      const Estimate e = estimate_position_difference(servo.record(), settings());
      ASSERT_EQ(e.status, Status::ok) << e.message;
      EXPECT_NEAR(e.backlash_angle, gap, 0.02 * gap) << noise;
      EXPECT_LE(e.angle_lower, gap) << noise;
      EXPECT_GE(e.angle_upper, gap) << noise;
    }
}

// The friction of the load, 10 N m, and not its inertia says which flank is pressed.
TEST(PositionDifference, ADraggedLoadShowsItsPlay) {
  Servo servo;
  servo.load_inertia = 0.5;
  servo.load_coulomb = 10;
  const Estimate e = estimate_position_difference(servo.record(), settings(servo));
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_LE(e.angle_lower, kGap) << e.message;
  EXPECT_GE(e.angle_upper, kGap) << e.message;
}

// A light load is dragged: each flank is pressed in one direction of motion only, as dry friction of the
// motor would have it. The load's own friction, declared to 30 %, is what presses it.
TEST(PositionDifference, PlayOfALoadThatIsDraggedIsNoFrictionOfTheMotor) {
  struct Load {
    double inertia, friction;  // kg m^2, N m: of the acceleration, 3.6 rad/s^2, less than of the friction
  };
  int answered = 0;
  for (const double gap : {1e-4, 5e-4})
    for (const double declared : {0.7, 1.0, 1.3})
      for (const Load load : {Load{0.5, 10}, {3, 40}, {10, 50}, {20, 80}}) {
        Servo servo;
        servo.gap = gap;
        servo.load_inertia = load.inertia;
        servo.load_coulomb = load.friction;
        PositionDifferenceSettings s = settings(servo);
        s.load_friction *= declared;
        const Estimate e = estimate_position_difference(servo.record(), s);
        if (e.status != Status::ok) continue;
        ++answered;
        EXPECT_LE(e.angle_lower, gap) << load.inertia << ' ' << declared << ": " << e.message;
        EXPECT_GE(e.angle_upper, gap) << load.inertia << ' ' << declared << ": " << e.message;
      }
  EXPECT_GE(answered, 6);  // where the gap is larger than what the friction bends the teeth by
}

// To and fro over the same path each flank is pressed in a part of it of its own: what errors of the encoders
// may be there is distinguished from play by the few windows in between, and by a torque that is all right.
TEST(PositionDifference, MovesOverTheSamePathGiveNoWrongPlay) {
  int answered = 0;
  for (const double gap : {3e-4, 1e-3})
    for (const double there : {0.7, 1.0})
      for (const double saturates : {0.0, 600.0})
        for (const double friction : {10.0, 30.0}) {
          Servo servo;
          servo.gap = gap;
          servo.there = there;
          servo.saturates = saturates;
          servo.load_coulomb = friction;
          const Estimate e = estimate_position_difference(servo.record(), settings());
          if (e.status != Status::ok) continue;
          ++answered;
          EXPECT_LE(e.angle_lower, gap) << there << " s: " << e.message;
          EXPECT_GE(e.angle_upper, gap) << there << " s: " << e.message;
        }
  EXPECT_GT(answered, 0);
}

// Teeth of which one side is stiffer, under a weight that presses the other one most of the time, were
// reported as up to seven times the play, from the few windows on the one.
TEST(PositionDifference, TeethWithOneStifferSideAreNoPlay) {
  int answered = 0;
  for (const double gap : {1e-4, 1e-3})
    for (const double weight : {0.0, 60.0, 100.0, 140.0})
      for (const double asymmetry : {-0.4, 0.3}) {
        Servo servo;
        servo.gap = gap;
        servo.weight = weight;
        servo.asymmetry = asymmetry;
        const Estimate e = estimate_position_difference(servo.record(), settings());
        if (e.status != Status::ok) continue;
        ++answered;
        EXPECT_LE(e.angle_lower, gap) << weight << " N m, " << asymmetry << ": " << e.message;
        EXPECT_GE(e.angle_upper, gap) << weight << " N m, " << asymmetry << ": " << e.message;
      }
  EXPECT_GT(answered, 0);
}

// A drive that chatters throws the motor from flank to flank within a few samples. What windows of them
// average follows the torque as if there were no play (describing function of dead zone with dither).
TEST(PositionDifference, ChatterOfTheDriveIsNoAbsenceOfPlay) {
  for (const double gap : {1e-4, 5e-4}) {
    Servo servo;
    servo.gap = gap;
    servo.chatter = 100;
    servo.swings = true;
    const Estimate e = estimate_position_difference(servo.record(), settings());
    EXPECT_NE(e.status, Status::ok) << e.backlash_angle << " of " << gap;
  }
}

// 2000 N m of 1 ms each throw 6.3 kg m^2 by 0.3 rad/s, as fast as this servo moves, though no position shows
// it: each sample is taken where the motor was thrown back.
TEST(PositionDifference, MeansOfATorqueThatAlternatesAreNotThoseOfTheTeeth) {
  Servo servo;
  servo.chatter = 2000;
  const Estimate e = estimate_position_difference(servo.record(), settings());
  EXPECT_EQ(e.status, Status::out_of_domain) << e.backlash_angle;
  EXPECT_NE(e.message.find("alternates"), std::string::npos) << e.message;
  servo.chatter = 100;  // a tenth of a twentieth of that: noise
  EXPECT_EQ(estimate_position_difference(servo.record(), settings()).status, Status::ok);
}

// Teeth that press harder the deeper they go: at 200 N m, 0.5 mrad, these are stiffer by a quarter, and by
// all.
TEST(PositionDifference, TeethThatHardenAreEstimatedOrTheIntervalHoldsThem) {
  for (const double hardening : {1e6, 4e6})
    for (const double gap : {2e-4, 5e-4}) {
      Servo servo;
      servo.gap = gap;
      servo.hardening = hardening;
      const Estimate e = estimate_position_difference(servo.record(), settings());
      if (e.status != Status::ok) continue;  // an honest answer
      EXPECT_LE(e.angle_lower, gap) << hardening << e.message;
      EXPECT_GE(e.angle_upper, gap) << hardening << e.message;
    }
}

// Hertz's teeth yield most where they begin to touch: with a spring in their place the play is estimated 1.5
// to 3 times too large. 0.71, 0.74 and 0.87 are none of the powers that are tried.
TEST(PositionDifference, TeethThatYieldByAPowerOfTheTorqueAreEstimatedOrTheIntervalHoldsThem) {
  int answered = 0;
  for (const double power : {2.0 / 3, 0.71, 0.74, 0.87})
    for (const double gap : {2e-4, 5e-4})
      for (const double noise : {1.0, 30.0}) {
        Servo servo;
        servo.gap = gap, servo.power = power, servo.torque_noise = noise;
        const Estimate e = estimate_position_difference(servo.record(), settings());
        const auto where = [&] { return fmt::format("{:.2g} {:.2g} {}: {}", power, gap, noise, e.message); };
        if (e.status != Status::ok) continue;  // an honest answer
        answered += noise == 1;
        EXPECT_LE(e.angle_lower, gap) << where();
        EXPECT_GE(e.angle_upper, gap) << where();
      }
  EXPECT_GE(answered, 7);  // of 8 with hardly any noise
}

/// The record of a torque sensor behind the gear instead of the motor's torque: the torque that the servo's
/// load takes.
record::Record with_output_torque(const Servo& servo, double sign) {
  record::Record r = servo.record();
  r.column(record::Channel::motor_torque).clear();
  Random random(5);
  for (const double t : r.time)
    r.column(record::Channel::output_torque)
        .push_back(sign * (servo.transmitted(t) + servo.torque_noise * random.normal()));
  return r;
}

TEST(PositionDifference, ATorqueSensorBehindTheGearShowsTheFlanksAsWell) {
  for (const double gap : {0.0, 5e-4, 2e-3})
    for (const double sign : {1.0, -1.0}) {
      Servo servo;
      servo.gap = gap;
      PositionDifferenceSettings s = settings();
      s.output_torque_reversed = sign < 0;
      const Estimate e = estimate_position_difference(with_output_torque(servo, sign), s);
      ASSERT_EQ(e.status, Status::ok) << e.message;
      EXPECT_NEAR(e.backlash_angle, gap, 2 * kNear) << e.message;
      EXPECT_LE(e.angle_lower, gap);
      EXPECT_GE(e.angle_upper, gap);
      s.output_torque_reversed =
          sign > 0;  // refused, or right by the few windows in which the torque is small
      const Estimate wrong = estimate_position_difference(with_output_torque(servo, sign), s);
      if (wrong.status != Status::ok) continue;
      EXPECT_LE(wrong.angle_lower, gap);
      EXPECT_GE(wrong.angle_upper, gap);
    }
  // At an axis that turns twice as fast as the load the sensor's torque counts half, angles twice.
  PositionDifferenceSettings s = settings();
  s.load_ratio = 2;
  s.elastic_deflection = [](double torque) { return 4 * torque / kStiffness; };
  record::Record r = with_output_torque(Servo(), 1);
  for (double& q : r.column(record::Channel::motor_position)) q *= 2;
  const Estimate e = estimate_position_difference(r, s);
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_NEAR(e.backlash_angle, 2 * kGap, 4 * kNear);
}

TEST(PositionDifference, TheRecordKnowsComplianceInertiaAndFrictionBetterThanTheRigFile) {
  Servo servo;
  servo.stiffness = 0.6 * kStiffness;
  servo.motor_inertia = 1.4 * kMotorInertia;
  servo.motor_coulomb = 90;
  const Estimate e = estimate_position_difference(servo.record(), settings());
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_NEAR(e.backlash_angle, kGap, kNear);
  EXPECT_NE(e.message.find("from the record, 1."), std::string::npos) << e.message;
}

TEST(PositionDifference, WhatBothFlanksShareIsNoPlay) {
  Servo offset, scale, eccentric;
  offset.offset = 0.3;
  scale.scale = 1.005;
  eccentric.eccentricity = 1e-4;
  for (const Servo& servo : {offset, scale, eccentric}) {
    const Estimate e = estimate_position_difference(servo.record(), settings());
    ASSERT_EQ(e.status, Status::ok) << e.message;
    EXPECT_NEAR(e.backlash_angle, kGap, 2 * kNear) << e.message;
  }
  scale.scale = 1.02;
  const Estimate e = estimate_position_difference(scale.record(), settings());
  EXPECT_EQ(e.status, Status::out_of_domain);
  EXPECT_NE(e.message.find("in scale"), std::string::npos) << e.message;
}

TEST(PositionDifference, AGapThatVariesWithPositionWidensTheInterval) {
  Servo servo;
  servo.gap_wave = 0.3;
  const Estimate e = estimate_position_difference(servo.record(), settings());
  ASSERT_EQ(e.status, Status::ok) << e.message;
  // sin(3 q) reaches 0.98 over the travel of +-0.65 rad; knots of straight lines cut the tops by a few per
  // cent.
  EXPECT_NEAR(e.angle_lower, kGap * 0.71, 0.05 * kGap);
  EXPECT_NEAR(e.angle_upper, kGap * 1.29, 0.05 * kGap);
  EXPECT_NE(e.message.find("depends on the position"), std::string::npos) << e.message;
}

/// Locked output, torque in slow triangles, elastic deflection with a power law.
record::Record locked(double gap, double compliance_error = 1) {
  record::Record r;
  for (int i = 0; i < 4000; ++i) {
    const double t = i / 1000.0, phase = std::fmod(t, 0.5) / 0.5;
    const double torque = 2 * (std::abs(4 * phase - 2) - 1);  // +-2 N m
    const double elastic = compliance_error * std::copysign(1e-3 * std::pow(std::abs(torque), 0.8), torque);
    r.time.push_back(t);
    r.column(record::Channel::motor_torque).push_back(torque);
    r.column(record::Channel::motor_position).push_back(elastic + 0.5 * gap * std::erf(torque / 0.01));
    r.column(record::Channel::load_position).push_back(0);
  }
  return r;
}

PositionDifferenceSettings locked_settings() {
  PositionDifferenceSettings s;
  s.elastic_deflection = [](double torque) {
    return std::copysign(1e-3 * std::pow(std::abs(torque), 0.8), torque);
  };
  s.base_radius = 0.02;
  return s;
}

TEST(PositionDifference, LockedOutputWithDeclaredElasticDeflection) {
  for (const double gap : {0.0, 1e-3, 5e-3}) {
    const Estimate e = estimate_position_difference(locked(gap), locked_settings());
    ASSERT_EQ(e.status, Status::ok) << e.message;
    // Averages over windows of a curved law: 1e-5 of 1.7e-3 rad of elastic deflection.
    EXPECT_NEAR(e.backlash_angle, gap, 2e-5);
    EXPECT_NEAR(e.backlash, 0.02 * e.backlash_angle, 1e-15);
    EXPECT_LE(e.angle_lower, gap);
    EXPECT_GE(e.angle_upper, gap);
  }
  // 2 % of the deflection on either side at the torque of the windows is what the declaration leaves open.
  const Estimate e = estimate_position_difference(locked(1e-3, 1.01), locked_settings());
  EXPECT_LE(e.angle_lower, 1e-3);
  EXPECT_GE(e.angle_upper, 1e-3);
}

// Names of torque and position exchanged: the "position" is a square wave that no torque could drive.
TEST(PositionDifference, PositionsThatJumpAreNoPositions) {
  record::Record r = locked(5e-3);
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double side = std::sin(2 * M_PI * 10 * r.time[i] + 0.01) > 0 ? 1 : -1;
    r.column(record::Channel::motor_torque)[i] = 5e-3 * side;
    r.column(record::Channel::motor_position)[i] = 0.05 * side;
  }
  PositionDifferenceSettings s = locked_settings();
  s.output_locked = true;
  s.motor_inertia = 2.2e-5;  // kg m^2: 5 mN m push it over 0.1 rad in 30 ms at best
  const Estimate e = estimate_position_difference(r, s);
  EXPECT_EQ(e.status, Status::out_of_domain);
  EXPECT_NE(e.message.find("jumps"), std::string::npos) << e.message;
}

TEST(PositionDifference, WhatTheRecordLacksBecomesAStatus) {
  const record::Record full = Servo().record();
  const auto status_without = [&full](record::Channel channel) {
    record::Record r = full;
    r.column(channel).clear();
    const Estimate e = estimate_position_difference(r, settings());
    EXPECT_TRUE(std::isnan(e.backlash_angle));
    EXPECT_FALSE(e.message.empty());
    return e.status;
  };
  EXPECT_EQ(status_without(record::Channel::motor_position), Status::insufficient_data);
  EXPECT_EQ(status_without(record::Channel::load_position), Status::insufficient_data);
  EXPECT_EQ(status_without(record::Channel::motor_torque), Status::insufficient_data);
  EXPECT_EQ(estimate_position_difference(full.slice(0, 0.05), settings()).status, Status::insufficient_data);
  // Enough samples to begin with, of which the longest averages leave no window at all.
  const double few = 100 * full.sampling_interval();
  EXPECT_EQ(estimate_position_difference(full.slice(0, few), settings()).status, Status::out_of_domain);
  record::Record one_sided = locked(1e-3);
  for (std::size_t i = 0; i < one_sided.size(); ++i) {
    one_sided.column(record::Channel::motor_torque)[i] = 1 + 0.1 * std::sin(20 * one_sided.time[i]);
    one_sided.column(record::Channel::motor_position)[i] = 1e-3 + 1e-6 * std::sin(20 * one_sided.time[i]);
  }
  const Estimate pressed = estimate_position_difference(one_sided, locked_settings());
  EXPECT_EQ(pressed.status, Status::out_of_domain);
  EXPECT_NE(pressed.message.find("does not press both flanks"), std::string::npos) << pressed.message;
  record::Record negative = locked(-2e-3);  // the declared machine would have to overlap
  EXPECT_NE(estimate_position_difference(negative, locked_settings()).status, Status::ok);
}

TEST(PositionDifference, RefusesSettingsOutOfRange) {
  const record::Record r = locked(1e-3);
  const auto refused = [&r](void (*spoil)(PositionDifferenceSettings&)) {
    PositionDifferenceSettings s = locked_settings();
    spoil(s);
    EXPECT_THROW(estimate_position_difference(r, s), InvalidParameter);
  };
  refused([](auto& s) { s.elastic_deflection = nullptr; });
  refused([](auto& s) { s.elastic_uncertainty = 0; });
  refused([](auto& s) { s.motor_inertia = -1; });
  refused([](auto& s) { s.load_ratio = 0; });
  refused([](auto& s) { s.base_radius = 0; });
}

}  // namespace
}  // namespace backlash::diagnosis
