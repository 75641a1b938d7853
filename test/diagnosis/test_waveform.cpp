// SPDX-License-Identifier: BSD-3-Clause
// What the estimator refuses. What it finds is tested on simulated machines: test/studies/test_waveform.cpp.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/waveform.h"
#include "support/records.h"

namespace backlash::diagnosis {
namespace {

using record::Channel;

/// About those of Sarkar, Ellis and Moore (1997), Table 2.
WaveformSettings settings() {
  WaveformSettings s;
  s.base_radius = 0.015;
  s.motor_inertia = s.pinion_inertia = s.gear_inertia = 2e-5;
  s.motor_damping = 0.005;
  s.sensor_stiffness = 30, s.sensor_damping = 2e-4;
  s.output_stiffness = 6000, s.output_damping = 0.05;
  s.contact_stiffness = 2e8, s.contact_loss = 0.7;
  return s;
}

test::RecordRecipe recipe() {
  test::RecordRecipe r;
  r.duration = 0.6, r.rate = 2000;
  return r;
}

void expect_refused(const record::Record& record, Status status, const std::string& reason) {
  const Estimate e = estimate_waveform(record, settings());
  EXPECT_EQ(e.method, "waveform");
  EXPECT_EQ(e.status, status) << e.message;
  EXPECT_NE(e.message.find(reason), std::string::npos) << e.message;
  EXPECT_TRUE(std::isnan(e.backlash));
}

TEST(Waveform, MissingChannels) {
  for (const Channel channel : {Channel::motor_torque, Channel::sensor_torque}) {
    record::Record r = test::make_record(recipe());
    r.column(channel).clear();
    expect_refused(r, Status::insufficient_data, "needs " + record::channel_name(channel));
  }
  record::Record r = test::make_record(recipe());
  r.column(Channel::motor_position)[100] = kNaN;
  expect_refused(r, Status::insufficient_data, "motor_position has gaps");
}

TEST(Waveform, NoReversals) {
  record::Record r = test::make_record(recipe());
  for (double& t : r.column(Channel::motor_torque)) t = 0.05;
  expect_refused(r, Status::insufficient_data, "never reverses");
  expect_refused(test::make_record(recipe()).slice(0, 0.12), Status::insufficient_data, "fewer than four");
}

/// The sensor of this record answers a square wave.
TEST(Waveform, AnotherTorqueThanTheOneThatDrove) {
  record::Record r = test::make_record(recipe());
  for (std::size_t i = 0; i < r.size(); ++i)
    r.column(Channel::motor_torque)[i] = 0.05 * std::sin(20 * M_PI * r.time[i]);
  expect_refused(r, Status::out_of_domain, "does not explain the torque");
}

TEST(Waveform, Sampling) {
  test::RecordRecipe slow = recipe(), uneven = recipe();
  slow.rate = 500;  // 2 ms, and the ring is 2 pi sqrt(1e-5 / 30) = 3.6 ms
  expect_refused(test::make_record(slow), Status::out_of_domain, "does not resolve the ring");
  uneven.jitter = 0.3;  // too much to count the samples by
  EXPECT_NE(estimate_waveform(test::make_record(uneven), settings()).status, Status::ok);
}

/// A ring of 130 Hz is written down there; this machine rings at 276 Hz and more.
TEST(Waveform, AnotherMachine) {
  const Estimate e = estimate_waveform(test::make_record(recipe()), settings());
  EXPECT_EQ(e.status, Status::out_of_domain) << e.message;
}

TEST(Waveform, SettingsOutOfRange) {
  const auto refuses = [](const std::function<void(WaveformSettings&)>& change) {
    WaveformSettings s = settings();
    change(s);
    EXPECT_THROW(estimate_waveform(record::Record(), s), InvalidParameter);
  };
  for (const double bad : {0.0, -1.0, kNaN, std::numeric_limits<double>::infinity()}) {
    refuses([&](WaveformSettings& s) { s.base_radius = bad; });
    refuses([&](WaveformSettings& s) { s.motor_inertia = bad; });
    refuses([&](WaveformSettings& s) { s.motor_damping = bad; });
    refuses([&](WaveformSettings& s) { s.sensor_stiffness = bad; });
    refuses([&](WaveformSettings& s) { s.output_damping = bad; });
    refuses([&](WaveformSettings& s) { s.contact_stiffness = bad; });
    refuses([&](WaveformSettings& s) {
      s.output = WaveformOutput::link, s.link_friction = 0, s.link_inertia = bad;
    });
  }
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {  // NaN: it has none
    refuses([&](WaveformSettings& s) { s.contact_loss = bad; });
    refuses([&](WaveformSettings& s) { s.contact_damping = bad; });
  }
  for (const double bad : {0.9, 1.6, kNaN}) refuses([&](WaveformSettings& s) { s.contact_exponent = bad; });
  refuses([](WaveformSettings& s) { s.angular = true; });  // with a radius of 15 mm
  refuses([](WaveformSettings& s) { s.dry_friction = -0.1; });
  refuses([](WaveformSettings& s) {
    s.output = WaveformOutput::link, s.link_inertia = 1e-4, s.link_friction = -0.1;
  });
}

}  // namespace
}  // namespace backlash::diagnosis
