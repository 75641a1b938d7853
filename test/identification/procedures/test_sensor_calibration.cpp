// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/identification/procedures/sensor_calibration.h"

namespace backlash::identification {
namespace {

// A motor that turns forward and back, a load behind it by half the play and the wind-up of its friction; the
// sensors of the thesis: motor 8.7e-7 rad, load 7e-6 rad resolution.
struct SensorRig {
  double scale = 1 + 1e-4, offset = 0.0123;         // load = scale * motor + offset where nothing is between
  double gap = 4.4e-4, wind_up = 4.5e-5;            // rad: total play, friction of the load / stiffness
  double speed_scale = 1.004, speed_offset = 2e-3;  // of the velocities
  double noise = 2.6e-4;                            // rad/s, of both velocities
  double torque_ripple = 1e-5;                      // rad of wind-up, at 5.3 Hz
};

double quantised(double x, double step) {
  return step * std::round(x / step);
}

/// One way for 10 s from `start` with 1 s of ramp at both ends, `rate` Hz; ends where it returns.
void run_one_way(record::Record& record, const SensorRig& rig, double speed, Random& random,
                 double& position) {
  constexpr double kInterval = 2e-3;
  const double t0 = record.time.empty() ? 0 : record.time.back() + kInterval;
  const double sign = speed > 0 ? 1 : -1;
  for (int i = 0; i < 5000; ++i) {
    const double t = i * kInterval, w = speed * std::min({1.0, t, 10 - t});
    position += w * kInterval;
    // The play is crossed in the first 0.15 s of the ramp.
    const double behind = sign * (0.5 * rig.gap + rig.wind_up) * std::min(1.0, 2 * t / 0.15 - 1);
    const double twist = rig.torque_ripple * std::sin(2 * M_PI * 5.3 * (t0 + t));
    record.time.push_back(t0 + t);
    record.column(record::Channel::motor_position).push_back(quantised(position, 8.7e-7));
    record.column(record::Channel::load_position)
        .push_back(quantised(rig.scale * position + rig.offset - behind + twist, 7e-6));
    record.column(record::Channel::motor_velocity).push_back(w + rig.noise * random.normal());
    record.column(record::Channel::load_velocity)
        .push_back(rig.speed_scale * w + rig.speed_offset + rig.noise * random.normal());
  }
}

record::Record runs(const SensorRig& rig, const std::vector<double>& speeds, unsigned seed = 1) {
  Random random(seed);
  record::Record record;
  record.name = "runs";
  double position = 0.1 * seed;
  for (const double speed : speeds) run_one_way(record, rig, speed, random, position);
  return record;
}

TEST(PositionCalibration, BothDirectionsGiveScaleOffsetAndPlay) {
  const SensorRig rig;
  const PositionCalibration c = calibrate_position({runs(rig, {0.3, -0.3})});
  // 2.5 rad of travel and means of 50 samples: quantisation 7e-6 / sqrt(12 * 50) and the ripple leave less
  // than 1e-6 rad per mean, some 1e-7 of the travel and of the mean of 150 of them.
  EXPECT_NEAR(c.scale.value, 1 + 1e-4, 3e-7);
  EXPECT_NEAR(c.offset.value, 0.0123, 1e-6);
  EXPECT_NEAR(c.play_and_wind_up.value, 4.4e-4 + 9e-5, 1e-6);
  EXPECT_GT(c.travel, 2);
  EXPECT_LT(c.scale.standard_error, 3e-7);
}

TEST(PositionCalibration, RunsMayBeRecordsOfTheirOwn) {
  const SensorRig rig;
  Random random(1);
  double position = 0;
  record::Record forward, back;
  run_one_way(forward, rig, 0.3, random, position);
  run_one_way(back, rig, -0.3, random, position);
  const PositionCalibration c = calibrate_position({forward, back});
  EXPECT_NEAR(c.play_and_wind_up.value, 4.4e-4 + 9e-5, 1e-6);
  EXPECT_NEAR(c.offset.value, 0.0123, 1e-6);
}

TEST(PositionCalibration, OneDirectionHoldsThePlayInItsOffsetAndSaysSo) {
  const SensorRig rig;
  const PositionCalibration c = calibrate_position({runs(rig, {0.3})});
  EXPECT_NEAR(c.scale.value, 1 + 1e-4, 3e-7);
  EXPECT_NEAR(c.offset.value, 0.0123 - 2.2e-4 - 4.5e-5, 1e-6);
  EXPECT_TRUE(std::isnan(c.play_and_wind_up.value));
  EXPECT_EQ(c.warnings.size(), 1u);
}

TEST(PositionCalibration, StandardErrorsAreHonestForErrorsOfTheSensors) {
  double squares = 0, stated = 0, play_squares = 0, play_stated = 0;
  constexpr int kSeeds = 60;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SensorRig rig;
    rig.torque_ripple = 0;
    record::Record record = runs(rig, {0.3, -0.3}, seed);
    Random random(1000 + seed);
    double coloured = 0;  // 20 ms memory: shorter than the parts that are left out
    for (double& x : record.column(record::Channel::load_position))
      x += coloured = 0.9 * coloured + 1e-4 * random.normal();
    const PositionCalibration c = calibrate_position({record});
    squares += std::pow(c.scale.value - rig.scale, 2);
    stated += std::pow(c.scale.standard_error, 2);
    play_squares += std::pow(c.play_and_wind_up.value - 5.3e-4, 2);
    play_stated += std::pow(c.play_and_wind_up.standard_error, 2);
  }
  // Variance from 60 seeds: sqrt(2 / 60) = 18 %, the stated one of 20 blocks sqrt(2 / 20 / 60) = 4 %: two and
  // a half of them; leaving out blocks overstates the variance by some 1 / 10.
  EXPECT_NEAR(squares / stated, 0.95, 0.5);
  EXPECT_NEAR(play_squares / play_stated, 0.95, 0.5);
}

TEST(PositionCalibration, RefusesWhatDoesNotTurnOneWay) {
  record::Record shaking;
  for (int i = 0; i < 5000; ++i) {
    shaking.time.push_back(i * 2e-3);
    shaking.column(record::Channel::motor_position).push_back(0.1 * std::sin(i * 2e-2));
    shaking.column(record::Channel::load_position).push_back(0.1 * std::sin(i * 2e-2));
  }
  EXPECT_THROW(calibrate_position({shaking}), CannotIdentify);
  EXPECT_THROW(calibrate_position({}), CannotIdentify);
  shaking.column(record::Channel::load_position).clear();
  EXPECT_THROW(calibrate_position({shaking}), CannotIdentify);
  CalibrationOptions options;
  options.block = 0;
  EXPECT_THROW(calibrate_position({shaking}, options), InvalidParameter);
}

TEST(SpeedCalibration, ScaleAndOffsetFromRunsOfDifferentSpeed) {
  const SensorRig rig;
  const SpeedCalibration c = calibrate_speed(runs(rig, {0.3, 0.9}));
  // Means of 50 samples of noise 2.6e-4 in both: 5e-5, some 170 of them over speeds of 0.1 to 0.9 rad/s.
  EXPECT_NEAR(c.scale.value, 1.004, 5e-5);
  EXPECT_NEAR(c.offset.value, 2e-3, 3e-5);
  EXPECT_NEAR(c.scale.value, 1.004, 4 * c.scale.standard_error);
  EXPECT_NEAR(c.offset.value, 2e-3, 4 * c.offset.standard_error);
}

TEST(SpeedCalibration, StandardErrorsAreHonest) {
  double squares = 0, stated = 0;
  constexpr int kSeeds = 60;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const SpeedCalibration c = calibrate_speed(runs({}, {0.3, 0.9}, seed));
    squares += std::pow(c.scale.value - 1.004, 2);
    stated += std::pow(c.scale.standard_error, 2);
  }
  EXPECT_NEAR(squares / stated, 0.95, 0.5);  // as above
}

TEST(SpeedCalibration, OneSpeedDoesNotSeparateScaleFromOffset) {
  record::Record record;
  record.name = "even";
  for (int i = 0; i < 5000; ++i) {
    record.time.push_back(i * 2e-3);
    record.column(record::Channel::motor_velocity).push_back(0.3);
    record.column(record::Channel::load_velocity).push_back(0.31);
  }
  EXPECT_THROW(calibrate_speed(record), CannotIdentify);
  record.column(record::Channel::load_velocity).clear();
  EXPECT_THROW(calibrate_speed(record), CannotIdentify);
}

}  // namespace
}  // namespace backlash::identification
