// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/identification/fit/servo_data.h"
#include "backlash_diagnosis/signal/bandwidth.h"

namespace backlash::identification {
namespace {

constexpr double kInterval = 0.0025, kSlow = 0.01, kFast = 1, kStep = 1e-4;  // s, rad, rad, rad

/// A sine of 0.25 Hz, rounded to the resolution of the encoder.
record::Record rounded_sine(double amplitude) {
  record::Record record;
  record.name = "sine";
  for (int k = 0; k < 8000; ++k) {
    const double t = k * kInterval;
    record.time.push_back(t);
    record.column(record::Channel::motor_torque).push_back(std::cos(0.5 * M_PI * t));
    record.column(record::Channel::motor_position)
        .push_back(kStep * std::round(amplitude * std::sin(0.5 * M_PI * t) / kStep));
  }
  return record;
}

model::Rig locked() {
  model::Rig rig;
  rig.motor.inertia = 1;
  rig.link_locked = true;
  return rig;
}

/// Root mean square of rate minus the true one, without the ends.
double rate_error(const ServoData& data, double amplitude) {
  double square = 0, n = 0;
  for (std::size_t k = 400; k + 400 < data.size(); ++k, ++n)
    square += std::pow(
        data.motor_rate[k] - 0.5 * M_PI * amplitude * std::cos(0.5 * M_PI * double(k) * kInterval), 2);
  return std::sqrt(square / n);
}

double speed(double amplitude) {
  return 0.5 * M_PI * amplitude / std::sqrt(2);  // root mean square
}

TEST(ServoData, EstimatesTheSpeedOfALockedMotorThatCrawls) {
  const ServoData data = servo_data(rounded_sine(kSlow), locked());
  // Raw, the rounding (uniform over a step) times the rate of a five-point difference is as large as the
  // speed.
  const double raw = 0.95 * kStep / std::sqrt(12.0) / kInterval;
  EXPECT_GT(raw, 0.9 * speed(kSlow));
  // The promise is a fiftieth for white noise; rounding is not white near the turns, so half as much again.
  EXPECT_LT(rate_error(data, kSlow), 1.5 * 0.02 * speed(kSlow));
  EXPECT_LE(data.rate_noise, 0.02 * speed(kSlow) * 1.02);  // the noise itself is part of the measured speed
  EXPECT_GT(data.rate_noise, 0.3 * rate_error(data, kSlow));  // honest within a factor, see above
}

TEST(ServoData, LeavesAClearSpeedAlone) {
  const record::Record record = rounded_sine(kFast);
  const ServoData data = servo_data(record, locked());
  EXPECT_EQ(data.motor, record.column(record::Channel::motor_position));
  // At least that of the rounding; the step is known from the record to the last digits.
  EXPECT_GE(data.rate_noise, 0.9999 * 0.95 * kStep / std::sqrt(12.0) / kInterval);
}

TEST(ServoData, LeavesThePositionThatDrivesALoadAlone) {
  record::Record record = rounded_sine(kSlow);
  model::Rig rig = locked();
  rig.link_locked = false;
  rig.link.inertia = 10;
  rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", 1e5}, {"damping", 100}});
  record.column(record::Channel::load_position) = record.column(record::Channel::motor_position);
  EXPECT_EQ(servo_data(record, rig).motor, record.column(record::Channel::motor_position));
}

}  // namespace
}  // namespace backlash::identification
