// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/encoder_skew.h"

namespace backlash::record {
namespace {

constexpr double kInertia = 6, kStiffness = 4e5;  // kg m^2, N m/rad

/// A load led along sines, its motor in closed form: compliance, and half a gap on the side of the torque.
struct Servo {
  double gap = 5e-4, friction = 30, noise = 1e-6;  // rad, N m, rad
  double stiffness = kStiffness, damping = 0;      // N m/rad; N m s/rad, of the motor, which no model knows

  static double load(double t) {
    return 0.6 * std::sin(2 * M_PI * 0.11 * t) + 0.05 * std::sin(2 * M_PI * 1.3 * t + 1);
  }
  static double rate(double t, double h = 1e-4) { return (load(t + h) - load(t - h)) / (2 * h); }
  double transmitted(double t) const {
    const double h = 1e-4;
    return 100 * (load(t + h) - 2 * load(t) + load(t - h)) / (h * h) + friction * std::tanh(rate(t) / 1e-3);
  }
  double motor(double t) const {
    return load(t) + transmitted(t) / stiffness + 0.5 * gap * std::tanh(transmitted(t));
  }
  signal::Measured skew(double late, double interval) const {
    std::mt19937 random(7);
    std::normal_distribution<double> normal(0, noise);
    std::vector<double> torque, motors, loads;
    for (double t = 0; t < 20; t += interval) {
      motors.push_back(motor(t) + normal(random));
      loads.push_back(load(t - late) + normal(random));
      const double h = 1e-3, acceleration = (load(t + h) - 2 * load(t) + load(t - h)) / (h * h);
      torque.push_back(transmitted(t) + kInertia * acceleration + damping * rate(t));
    }
    return encoder_skew({interval, torque, motors, loads, kInertia});
  }
};

// Truth within two standard errors, as the estimate says of itself; at 250 Hz as at 1 kHz.
TEST(EncoderSkew, IsToldBesidePlayComplianceAndFriction) {
  for (const double interval : {1e-3, 4e-3})
    for (const double gap : {0.0, 5e-4, 2e-3})
      for (const double late : {-3e-3, 0.0, 2e-3, 5e-3, 2e-2}) {
        Servo servo;
        servo.gap = gap;
        const signal::Measured skew = servo.skew(late, interval);
        EXPECT_NEAR(skew.value, late, 2 * skew.standard_error) << gap << " " << interval;
        EXPECT_EQ(is_clear(skew), late != 0) << skew.value << " +- " << skew.standard_error;
      }
}

// Drag of the motor is torque that never reaches the teeth: where these are soft it looks like a skew of
// damping / stiffness, here 0.3 ms.
TEST(EncoderSkew, DragOfTheMotorIsNone) {
  Servo servo;
  servo.stiffness = 2e4;
  servo.damping = 6;
  const signal::Measured skew = servo.skew(0, 1e-3);
  EXPECT_NEAR(skew.value, -servo.damping / servo.stiffness, 1e-4);
  EXPECT_FALSE(is_clear(skew)) << skew.value << " +- " << skew.standard_error;
  EXPECT_TRUE(is_clear(servo.skew(2e-2, 1e-3)));
}

TEST(EncoderSkew, IsNotToldOfALoadThatStands) {
  const std::vector<double> none(5000, 0.0);
  EXPECT_THROW(encoder_skew({1e-3, none, none, none, 1}), CannotIdentify);
  const std::vector<double> few(20, 1.0);
  EXPECT_THROW(encoder_skew({1e-3, few, few, few, 1}), Error);
}

// Cubic interpolation of a sine of 1 Hz at 1 kHz: error far below 1e-8.
TEST(EncoderSkew, IsTakenOutOfTheLoadAlone) {
  Record record;
  for (int k = 0; k < 2000; ++k) {
    const double t = 1e-3 * k;
    record.time.push_back(t);
    record.column(Channel::motor_position).push_back(std::sin(2 * M_PI * t));
    record.column(Channel::load_position).push_back(std::sin(2 * M_PI * (t - 3.3e-3)));
  }
  const Record mended = without_encoder_skew(record, 3.3e-3);
  EXPECT_EQ(mended.column(Channel::motor_position), record.column(Channel::motor_position));
  for (int k = 10; k < 1990; ++k)
    EXPECT_NEAR(mended.column(Channel::load_position)[k], std::sin(2 * M_PI * 1e-3 * k), 1e-8);
}

}  // namespace
}  // namespace backlash::record
