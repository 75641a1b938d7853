// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/momentum_transfer.h"

namespace backlash::diagnosis {
namespace {

constexpr double kInertia = 1e-3;  // kg m^2
constexpr double kTorque = 1;      // N m
constexpr double kRate = 10000;    // Hz

/// A rigid body between two walls that swallow its momentum, under a square wave of 10 Hz: at rest on a wall,
/// it crosses the gap with constant acceleration and hits with w^2 = 2 kTorque gap / kInertia. `unlike`: by
/// which share crossings differ, by the tachometer.
record::Record crossing(double mean_gap, double noise = 0, double torque_bias = 0, double unlike = 0) {
  record::Record r;
  Random random(5);
  for (int i = 0; i < kRate; ++i) {
    const double t = i / kRate, half = std::floor(20 * t + 1e-9), since = t - half / 20;
    const double sign = std::fmod(half, 2) == 0 ? 1 : -1;
    const double gap = mean_gap * (1 + unlike * std::sin(half));
    const double acceleration = kTorque / kInertia, flight = std::sqrt(2 * gap / acceleration);
    const bool flies = since < flight && torque_bias == 0;
    r.time.push_back(t);
    r.column(record::Channel::motor_torque).push_back(torque_bias + sign * kTorque);
    r.column(record::Channel::motor_velocity)
        .push_back((flies ? sign * acceleration * since : 0) + noise * random.normal());
    r.column(record::Channel::motor_position)
        .push_back(sign * (flies ? 0.5 * acceleration * since * since - 0.5 * gap : 0.5 * gap));
  }
  return r;
}

MomentumTransferSettings settings() {
  MomentumTransferSettings s;
  s.motor_inertia = kInertia;
  s.output_locked = true;
  s.base_radius = 0.02;
  return s;
}

TEST(MomentumTransfer, TravelOfAFreeFlightFromRest) {
  for (const double gap : {2e-3, 1e-2, 4e-2}) {
    const double speed = std::sqrt(2 * kTorque * gap / kInertia);
    for (const bool tachometer : {true, false}) {
      record::Record record = crossing(gap);
      record.column(tachometer ? record::Channel::motor_position : record::Channel::motor_velocity).clear();
      const Estimate e = estimate_momentum_transfer(record, settings());
      ASSERT_EQ(e.status, Status::ok) << e.message;
      EXPECT_EQ(e.method, "momentum_transfer");
      // The impact is known to a sample.
      EXPECT_NEAR(e.backlash_angle, gap, speed / kRate) << tachometer;
      // The release, found to half a sample at little speed, may add a hundredth of the gap.
      EXPECT_LE(e.angle_lower, 1.01 * gap) << tachometer << ' ' << gap;
      EXPECT_GE(e.angle_upper, 0.99 * gap) << tachometer << ' ' << gap;
      EXPECT_LT(e.angle_upper - e.angle_lower, 4 * speed / kRate);
      EXPECT_DOUBLE_EQ(e.backlash, 0.02 * e.backlash_angle);
    }
  }
}

// The torque that dry friction takes in flight is added to the recorded one, so that the motion is the same.
TEST(MomentumTransfer, DryFrictionOfTheMotorIsNoTorqueOfTheTeeth) {
  constexpr double kGap = 1e-2, kFriction = 0.5;
  record::Record record = crossing(kGap);
  for (std::size_t i = 0; i < record.size(); ++i) {
    const double speed = record.column(record::Channel::motor_velocity)[i];
    record.column(record::Channel::motor_torque)[i] += speed == 0 ? 0 : std::copysign(kFriction, speed);
  }
  MomentumTransferSettings s = settings();
  EXPECT_NE(estimate_momentum_transfer(record, s).status, Status::ok);
  s.motor_friction = kFriction;
  const Estimate e = estimate_momentum_transfer(record, s);
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_NEAR(e.backlash_angle, kGap, std::sqrt(2 * kTorque * kGap / kInertia) / kRate);  // a sample
  s.motor_friction = 2 * kTorque;  // more than the flanks carry
  EXPECT_EQ(estimate_momentum_transfer(record, s).status, Status::out_of_domain);
}

// Of a free load the friction is that which leaves nothing in flight, not the declared one.
TEST(MomentumTransfer, DryFrictionIsEstimatedInFlightWhereTheLoadIsFree) {
  constexpr double kGap = 1e-2, kFriction = 0.5;
  record::Record record = crossing(kGap);
  for (std::size_t i = 0; i < record.size(); ++i) {
    const double speed = record.column(record::Channel::motor_velocity)[i];
    record.column(record::Channel::motor_torque)[i] += speed == 0 ? 0 : std::copysign(kFriction, speed);
  }
  record.column(record::Channel::load_position).assign(record.size(), 0.0);
  for (const double declared : {0.3 * kFriction, 1.7 * kFriction}) {
    MomentumTransferSettings s = settings();
    s.output_locked = false, s.motor_friction = declared;
    const Estimate e = estimate_momentum_transfer(record, s);
    ASSERT_EQ(e.status, Status::ok) << e.message;
    EXPECT_NEAR(e.backlash_angle, kGap,
                0.03 * kGap);  // the release, found to half a sample either side of the jump
    EXPECT_LE(e.angle_lower, 1.01 * kGap);
    EXPECT_GE(e.angle_upper, 0.97 * kGap);
  }
}

// No play is reported of a free load whose flanks, as declared, may yield by as much as was travelled.
TEST(MomentumTransfer, OfAFreeLoadNoPlayIsNotReported) {
  constexpr double kGap = 1e-2;
  record::Record record = crossing(kGap);
  record.column(record::Channel::load_position).assign(record.size(), 0.0);
  MomentumTransferSettings s = settings();
  s.output_locked = false;
  s.flank_deflection = [](double torque) { return 1e-5 * torque; };
  EXPECT_EQ(estimate_momentum_transfer(record, s).status, Status::ok);
  s.flank_deflection = [](double torque) { return 1e-3 * torque; };
  s.elastic_uncertainty = 1;
  const Estimate e = estimate_momentum_transfer(record, s);
  EXPECT_EQ(e.status, Status::insufficient_data) << e.message;
}

// Crossings of 0.8 to 1.2 of the mean have a standard deviation of 0.14 of it.
// Against a locked output all cross the same gap: such a record is refused.
TEST(MomentumTransfer, OfAFreeLoadTheIntervalHoldsMostOfTheCrossings) {
  record::Record record = crossing(1e-2, 0, 0, 0.2);
  record.column(record::Channel::load_position).assign(record.size(), 0.0);
  MomentumTransferSettings s = settings();
  const Estimate locked = estimate_momentum_transfer(record, s);
  s.output_locked = false;
  const Estimate free = estimate_momentum_transfer(record, s);
  EXPECT_EQ(locked.status, Status::out_of_domain);
  EXPECT_NE(locked.message.find("not all are crossings of one gap"), std::string::npos) << locked.message;
  ASSERT_EQ(free.status, Status::ok) << free.message;
  EXPECT_GT(free.angle_upper - free.angle_lower, 0.28e-2);
}

// The same from the motion alone, of which the level of the torque is no part: the inertia scales it.
TEST(MomentumTransfer, TravelOfAFreeFlightWithoutATorque) {
  for (const double gap : {2e-3, 1e-2, 4e-2})
    for (const bool tachometer : {true, false})
      for (const double wrong : {1.0, 1.3}) {
        record::Record record = crossing(gap);
        record.column(record::Channel::motor_torque).clear();
        record.column(tachometer ? record::Channel::motor_position : record::Channel::motor_velocity).clear();
        MomentumTransferSettings s = settings();
        s.motor_inertia *= wrong;
        const Estimate e = estimate_momentum_transfer(record, s);
        ASSERT_EQ(e.status, Status::ok) << tachometer << ' ' << gap << ' ' << e.message;
        EXPECT_LE(e.angle_lower, 1.02 * gap) << tachometer << ' ' << gap;
        EXPECT_GE(e.angle_upper, 0.98 * gap) << tachometer << ' ' << gap;
        // Two samples of the speed at the impact.
        EXPECT_NEAR(e.backlash_angle, gap, 2 * std::sqrt(2 * kTorque * gap / kInertia) / kRate);
        EXPECT_NE(e.message.find("estimated from the motion"), std::string::npos) << e.message;
      }
}

TEST(MomentumTransfer, WithoutATorqueOnlyASquareWaveIsEstimated) {
  record::Record sine = crossing(0.01);  // a motor that swings freely
  sine.column(record::Channel::motor_torque).clear();
  record::Record still = sine, random = sine;
  Random noise(3);
  double speed = 0;
  for (std::size_t i = 0; i < sine.size(); ++i) {
    const double t = sine.time[i];
    sine.column(record::Channel::motor_velocity)[i] = std::sin(20 * M_PI * t);
    sine.column(record::Channel::motor_position)[i] = -std::cos(20 * M_PI * t) / (20 * M_PI);
    still.column(record::Channel::motor_velocity)[i] = 1e-3 * noise.normal();
    speed += 0.1 * noise.normal() - 0.01 * speed;
    random.column(record::Channel::motor_velocity)[i] = speed;
  }
  for (const record::Record* r : {&sine, &still, &random}) {
    const Estimate e = estimate_momentum_transfer(*r, settings());
    EXPECT_TRUE(e.status == Status::insufficient_data || e.status == Status::out_of_domain) << e.message;
  }
}

TEST(MomentumTransfer, ElasticDeflectionOfTheFlanksIsNoGap) {
  MomentumTransferSettings s = settings();
  const double all = estimate_momentum_transfer(crossing(0.04), s).backlash_angle;
  s.flank_deflection = [](double torque) { return 1e-3 * torque / kTorque; };
  const Estimate e = estimate_momentum_transfer(crossing(0.04), s);
  // At half of the resting torque on release, and more than that at the impact.
  EXPECT_LT(e.backlash_angle, all - 1.0e-3);
  EXPECT_LE(e.angle_lower, e.backlash_angle);
}

TEST(MomentumTransfer, ALoadThatMovesIsSubtracted) {
  MomentumTransferSettings s = settings();
  s.output_locked = false;
  s.load_ratio = 2;
  record::Record record = crossing(0.01);
  EXPECT_EQ(estimate_momentum_transfer(record, s).status, Status::insufficient_data);
  for (std::size_t i = 0; i < record.size(); ++i) {
    const double drift = 0.3 * record.time[i];
    record.column(record::Channel::motor_velocity)[i] += 0.3;
    record.column(record::Channel::load_position).push_back(0.5 * drift);
  }
  const Estimate e = estimate_momentum_transfer(record, s);
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_NEAR(e.backlash_angle, 0.01, std::sqrt(2 * kTorque * 0.01 / kInertia) / kRate);
}

TEST(MomentumTransfer, WithoutAGapContactIsNeverLost) {
  const Estimate e = estimate_momentum_transfer(crossing(0), settings());
  EXPECT_NE(e.status, Status::ok) << e.message;
  EXPECT_FALSE(e.backlash_angle > 1e-3);
}

TEST(MomentumTransfer, RefusesWhatItCannotSee) {
  EXPECT_EQ(estimate_momentum_transfer(crossing(0.01, 0, 3), settings()).status, Status::out_of_domain);
  const Estimate noisy = estimate_momentum_transfer(crossing(0.01, 5), settings());
  EXPECT_EQ(noisy.status, Status::out_of_domain);
  EXPECT_NE(noisy.message.find("noise"), std::string::npos) << noisy.message;
  EXPECT_EQ(estimate_momentum_transfer(crossing(0.01).slice(0, 0.12), settings()).status,
            Status::insufficient_data);
  record::Record r = crossing(0.01);
  r.column(record::Channel::motor_velocity).clear();
  r.column(record::Channel::motor_position).clear();
  EXPECT_EQ(estimate_momentum_transfer(r, settings()).status, Status::insufficient_data);
  // Motor and pinion swing at 2 kHz: five samples per cycle.
  MomentumTransferSettings s = settings();
  s.pinion_inertia = kInertia;
  s.coupling_stiffness = 0.5 * kInertia * std::pow(2 * M_PI * 2000, 2);
  EXPECT_EQ(estimate_momentum_transfer(crossing(0.01), s).status, Status::out_of_domain);
}

// Averages of up to 3.4 ms blur flights of 1 and 2 ms: the play may be estimated, but not to a hundredth.
TEST(MomentumTransfer, NoiseMovesReleaseAndImpact) {
  for (const double gap : {5e-4, 1e-3, 2e-3})
    for (const double noise : {0.1, 0.2, 0.3, 0.5}) {  // N m, of 1
      record::Record record = crossing(gap);
      Random random(7);
      for (double& torque : record.column(record::Channel::motor_torque)) torque += noise * random.normal();
      for (double& speed : record.column(record::Channel::motor_velocity)) speed += 0.01 * random.normal();
      const Estimate e = estimate_momentum_transfer(record, settings());
      ASSERT_EQ(e.status, Status::ok) << e.message;
      EXPECT_LE(e.angle_lower, gap) << noise;
      EXPECT_GE(e.angle_upper, gap) << noise;
    }
}

TEST(MomentumTransfer, RefusesFlightsThatTheDeclaredInertiaDoesNotExplain) {
  record::Record record = crossing(0.01);
  for (double& torque : record.column(record::Channel::motor_torque))
    torque *= 1.6;  // 0.6 of 1.6 N m left in flight
  const Estimate e = estimate_momentum_transfer(record, settings());
  EXPECT_EQ(e.status, Status::out_of_domain);
  EXPECT_NE(e.message.find("fly freely"), std::string::npos) << e.message;
}

// A motor that viscous friction leads from wall to wall at its terminal speed, tau / c, after J / c = 1 ms:
// of what is on the flank its momentum says nothing.
TEST(MomentumTransfer, RefusesAMotorThatFrictionLeadsAcrossTheGap) {
  constexpr double kGap = 0.03, kDamping = 1;  // rad, N m s/rad: 30 ms on the way
  record::Record r;
  for (int i = 0; i < kRate; ++i) {
    const double t = i / kRate, half = std::floor(20 * t + 1e-9), since = t - half / 20;
    const double sign = std::fmod(half, 2) == 0 ? 1 : -1, speed = kTorque / kDamping;
    const bool flies = since < kGap / speed;
    r.time.push_back(t);
    r.column(record::Channel::motor_torque).push_back(sign * kTorque);
    r.column(record::Channel::motor_position)
        .push_back(sign * (flies ? speed * since - 0.5 * kGap : 0.5 * kGap));
  }
  MomentumTransferSettings s = settings();
  s.motor_damping = kDamping;
  const Estimate e = estimate_momentum_transfer(r, s);
  EXPECT_EQ(e.status, Status::out_of_domain);
  EXPECT_NE(e.message.find("led across the gap"), std::string::npos) << e.message;
}

TEST(MomentumTransfer, RefusesSettingsOutOfRange) {
  const auto refused = [](void (*spoil)(MomentumTransferSettings&)) {
    MomentumTransferSettings s = settings();
    spoil(s);
    EXPECT_THROW(estimate_momentum_transfer(record::Record(), s), InvalidParameter);
  };
  refused([](auto& s) { s.motor_inertia = kNaN; });
  refused([](auto& s) { s.motor_damping = -1; });
  refused([](auto& s) { s.pinion_inertia = -1; });
  refused([](auto& s) { s.coupling_stiffness = 0; });
  refused([](auto& s) { s.coupling_stiffness = 10; });  // a pinion without inertia beyond it
  refused([](auto& s) { s.load_ratio = 0; });
  refused([](auto& s) { s.base_radius = -1; });
}

}  // namespace
}  // namespace backlash::diagnosis
