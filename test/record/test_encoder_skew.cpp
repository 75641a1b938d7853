// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/record/encoder_skew.h"
#include "support/led_servo.h"

namespace backlash::record {
namespace {

/// Encoders that round to an uncertainty of 1e-6 rad, no friction in the motor, and a way across the gap that
/// samples at 250 Hz need not resolve.
test::LedServo servo() {
  test::LedServo s;
  s.load_coulomb = 30, s.motor_coulomb = 0, s.torque_noise = 0;
  s.light = true;
  s.motor_step = s.load_step = std::sqrt(12) * 1e-6;
  return s;
}

signal::Measured skew_of(test::LedServo s, double late, double interval) {
  s.skew = late;
  const Record r = s.record(1 / interval);
  return encoder_skew({interval, r.column(Channel::motor_torque), r.column(Channel::motor_position),
                       r.column(Channel::load_position), s.motor_inertia});
}

// Truth within two standard errors, as the estimate says of itself; at 250 Hz as at 1 kHz.
TEST(EncoderSkew, IsEstimatedBesidePlayComplianceAndFriction) {
  for (const double interval : {1e-3, 4e-3})
    for (const double gap : {0.0, 5e-4, 2e-3})
      for (const double late : {-3e-3, 0.0, 2e-3, 5e-3, 2e-2}) {
        test::LedServo s = servo();
        s.gap = gap;
        const signal::Measured skew = skew_of(s, late, interval);
        EXPECT_NEAR(skew.value, late, 2 * skew.standard_error) << gap << " " << interval;
        EXPECT_EQ(is_clear(skew), late != 0) << skew.value << " +- " << skew.standard_error;
      }
}

// Drag of the motor is torque that never reaches the teeth: where these are soft it looks like a skew of
// damping / stiffness, here 0.3 ms.
TEST(EncoderSkew, DragOfTheMotorIsNone) {
  test::LedServo s = servo();
  s.stiffness = 2e4;
  s.motor_viscous = 6;
  const signal::Measured skew = skew_of(s, 0, 1e-3);
  EXPECT_NEAR(skew.value, -s.motor_viscous / s.stiffness, 1e-4);
  EXPECT_FALSE(is_clear(skew)) << skew.value << " +- " << skew.standard_error;
  EXPECT_TRUE(is_clear(skew_of(s, 2e-2, 1e-3)));
}

TEST(EncoderSkew, IsNotEstimatedOfALoadThatStands) {
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
