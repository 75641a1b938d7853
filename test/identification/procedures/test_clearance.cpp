// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/procedures/clearance.h"
#include "support/two_mass.h"

namespace backlash::identification {
namespace {

using test::simulate;
using test::TwoMasses;
using test::TwoMassSensors;

constexpr double kGap = 4.4e-4;  // rad, of TwoMasses

/// A hand that swings the load: a sine of a little varying size and pace.
TwoMasses pushed(double inertia, double torque, double frequency) {
  TwoMasses machine;
  machine.load_inertia = inertia;
  machine.braked = true;
  machine.load_torque = [=](double t) {
    return torque * (1 + 0.2 * std::sin(1.3 * t)) *
           std::sin(2 * M_PI * frequency * t + 0.5 * std::sin(0.9 * t));
  };
  return machine;
}

record::Record record_of(const std::function<double(double)>& load, double duration) {
  record::Record r;
  for (int i = 0; i < int(1000 * duration); ++i) {
    r.time.push_back(1e-3 * i);
    r.column(record::Channel::load_position).push_back(load(1e-3 * i));
    r.column(record::Channel::motor_position).push_back(0.1);
  }
  return r;
}

TEST(Clearance, FreeFlightBetweenElasticFlanksInClosedForm) {
  // At speed v across the gap, then half a sine of amplitude v / w on the flank, and back: no push, no loss.
  const double v = 0.01, w = 90, flight = kGap / v, contact = M_PI / w;
  const auto load = [&](double t) {
    const double half = flight + contact, s = std::fmod(t, 2 * half);
    const double u = s < half ? s : s - half, sign = s < half ? 1 : -1;
    return 0.3 + sign * (u < flight ? v * u - kGap / 2 : kGap / 2 + v / w * std::sin(w * (u - flight)));
  };
  const Clearance c = identify_clearance(record_of(load, 3));
  EXPECT_EQ(c.found, int(c.passages.size()));
  EXPECT_NEAR(c.gap.value, kGap, 0.005 * kGap);  // the penetration is low-passed at 120 Hz, w is 14 Hz
  EXPECT_NEAR(c.contact_frequency, w, 0.01 * w);
  EXPECT_NEAR(c.lower, 0.2 - kGap / 2, 0.01 * kGap);
  EXPECT_NEAR(c.upper, 0.2 + kGap / 2, 0.01 * kGap);
  // What a reading from turning point to turning point gives, less the slow ends that are cut.
  EXPECT_GT(c.travel.value, kGap + v / w);
}

TEST(Clearance, TheRigOfTheThesisPushedByHand) {
  const double runs[][3] = {{42, 40, 1.5}, {42, 40, 2}, {42, 80, 1.5}, {108, 80, 1}, {108, 80, 1.5}};
  for (const auto& run : runs) {
    const TwoMasses machine = pushed(run[0], run[1], run[2]);
    const Clearance c = identify_clearance(simulate(machine, 8));
    EXPECT_NEAR(c.gap.value, kGap, 3 * c.gap.standard_error) << run[0] << ' ' << run[1] << ' ' << run[2];
    EXPECT_LT(c.gap.standard_error, 0.03 * kGap);  // three of the steps of the sensor are 5 %
    EXPECT_GT(c.travel.value, 1.5 * kGap);         // while the travel says this
    EXPECT_NEAR(c.contact_frequency, std::sqrt(machine.stiffness / run[0]), 0.03 * c.contact_frequency);
    EXPECT_TRUE(c.warnings.empty());
    for (const GapPassage& p : c.passages) {
      EXPECT_EQ(p.time.size(), p.fitted.size());
      EXPECT_LT(p.deviation, 2 * 7e-6 / std::sqrt(12));  // the steps of the load's sensor
    }
  }
}

TEST(Clearance, StiffnessAndInertiaMayBeGiven) {
  const TwoMasses machine = pushed(42, 40, 2);
  ClearanceSettings settings;
  settings.stiffness = machine.stiffness;
  settings.load_inertia = machine.load_inertia;
  const Clearance c = identify_clearance(simulate(machine, 6), settings);
  EXPECT_NEAR(c.gap.value, kGap, 3 * c.gap.standard_error);
  EXPECT_DOUBLE_EQ(c.contact_frequency, std::sqrt(machine.stiffness / 42));
  settings.load_inertia = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(identify_clearance(simulate(machine, 1), settings), InvalidParameter);
}

TEST(Clearance, SpringBackOfTheMotorIsTakenOff) {
  // The brake gives way by thirty steps of the motor's sensor on either side, and the flanks with it.
  const TwoMasses machine = pushed(42, 80, 1.5);
  record::Record record = simulate(machine, 6);
  auto& motor = record.column(record::Channel::motor_position);
  auto& load = record.column(record::Channel::load_position);
  for (std::size_t i = 0; i < motor.size(); ++i) {
    const double x = load[i], step = 0.0055 / 110 * M_PI / 180;
    const double give = 30 * step * (x > kGap / 2 ? 1 : x < -kGap / 2 ? -1 : 0);
    motor[i] += give;
    load[i] += give;
  }
  const Clearance c = identify_clearance(record);
  EXPECT_NEAR(c.gap.value, kGap, 3 * c.gap.standard_error);
  EXPECT_GT(c.passages[0].motor_travel, 0);
}

TEST(Clearance, StandardErrorCoversTheScatter) {
  const int runs = 8;
  double squares = 0, stated = 0;
  for (int seed = 0; seed < runs; ++seed) {
    TwoMasses machine =
        pushed(42, 50 + 3 * seed, 1.5 + 0.05 * seed);  // steps of a sensor repeat, hands do not
    const signal::Measured gap = identify_clearance(simulate(machine, 4)).gap;
    squares += std::pow(gap.value - kGap, 2) / runs;
    stated += std::pow(gap.standard_error, 2) / runs;
  }
  // It holds the difference of the two pushes, so it may be too large; not too small by 1.6, where 8 runs
  // leave 25 %.
  EXPECT_LT(std::sqrt(squares / stated), 1.6);
}

TEST(Clearance, WhatIsNotDeterminedIsRefused) {
  const TwoMasses machine = pushed(42, 80, 1.5);
  const record::Record record = simulate(machine, 4);
  record::Record blind = record;
  blind.column(record::Channel::motor_position).clear();
  EXPECT_THROW(identify_clearance(blind), CannotIdentify);
  EXPECT_THROW(identify_clearance(record.slice(0, 0.6)), CannotIdentify);  // one or two passages
  record::Record free = record;                                            // the motor follows half way
  for (std::size_t i = 0; i < free.size(); ++i)
    free.column(record::Channel::motor_position)[i] = -0.5 * free.column(record::Channel::load_position)[i];
  EXPECT_THROW(identify_clearance(free), CannotIdentify);
  // A load that swings inside the gap and never meets a flank.
  const double step = 7e-6;
  EXPECT_THROW(identify_clearance(record_of(
                   [&](double t) { return step * std::round(2e-4 * std::sin(2 * M_PI * 2 * t) / step); }, 4)),
               CannotIdentify);
  ClearanceSettings bad;
  bad.least_passages = 1;
  EXPECT_THROW(identify_clearance(record, bad), InvalidParameter);
}

}  // namespace
}  // namespace backlash::identification
