// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/identification/procedures/decay.h"
#include "support/two_mass.h"

namespace backlash::identification {
namespace {

using test::simulate;
using test::TwoMasses;
using test::TwoMassSensors;

const TwoMassSensors kPerfect = {0, 0, 0, 0, 1, 1};

TwoMasses square_wave(double amplitude, double period, double damping = 515) {
  TwoMasses machine;
  machine.damping = damping;
  machine.motor_torque = [=](double t, double) {
    return std::fmod(t, period) < period / 2 ? amplitude : -amplitude;
  };
  return machine;
}

DecaySettings settings_of(const TwoMasses& machine) {
  DecaySettings s;
  s.stiffness.value = machine.stiffness;
  s.reduced_inertia.value = machine.reduced_inertia();
  return s;
}

/// Ringing as a formula after every torque step, motor and load turning one way: z, w0 as given.
record::Record closed_form(double z, double w0, double noise, unsigned seed, int steps = 9) {
  record::Record r;
  Random random(seed);
  const double wd = w0 * std::sqrt(1 - z * z);
  for (int i = 0; i < (steps + 1) * 500; ++i) {
    const double t = 1e-3 * i, since = std::fmod(t, 0.5), sign = std::fmod(t, 1.0) < 0.5 ? 1 : -1;
    const double y =
        0.01 + 0.02 * since + sign * 0.1 * std::exp(-z * w0 * since) * std::sin(wd * since + 0.3);
    r.time.push_back(t);
    r.column(record::Channel::motor_torque).push_back(150 * sign);
    r.column(record::Channel::motor_velocity).push_back(1 + 0.8 * y + noise * random.normal());
    r.column(record::Channel::load_velocity).push_back(1 - 0.2 * y);
  }
  return r;
}

DecaySettings settings_of(double w0) {
  DecaySettings s;
  s.reduced_inertia = {7, 0.07};
  s.stiffness = {7 * w0 * w0, 0.02 * 7 * w0 * w0};
  return s;
}

TEST(Decay, ClosedFormIsFoundExactly) {
  for (const double z : {0.03, 0.1, 0.188, 0.3}) {
    const double w0 = 230;
    const DecayIdentification d = identify_decay(closed_form(z, w0, 0, 1), settings_of(w0));
    EXPECT_EQ(d.signal, RingingSignal::speed_difference);
    EXPECT_EQ(d.steps, 9);
    EXPECT_EQ(d.ringings.size(), 9u) << z;
    EXPECT_NEAR(d.damping_ratio.value, z, 1e-6);  // the fit's tolerance, 1e-6 of its step
    EXPECT_NEAR(d.natural_frequency.value, w0, 1e-6 * w0);
    EXPECT_NEAR(d.damping.value, 2 * z * 7 * w0, 1e-5 * 14 * w0);
    EXPECT_NEAR(d.damping_by_rate.value, 2 * z * 7 * w0, 1e-5 * 14 * w0);
    // Errors of stiffness (2 %) and inertia (1 %) come through their square roots.
    EXPECT_NEAR(d.damping.standard_error / d.damping.value, std::hypot(0.01, 0.005), 1e-4);
    // A parabola over an eighth of a period either side of an extreme; the same at each but for the few
    // samples.
    EXPECT_NEAR(d.peak_damping_ratio.value, z, 0.01 * z);
    EXPECT_TRUE(d.warnings.empty());
  }
}

TEST(Decay, StandardErrorIsThatOfTheScatter) {
  const int runs = 40;
  double sum = 0, squares = 0, stated = 0;
  for (int seed = 0; seed < runs; ++seed) {
    const signal::Measured z =
        identify_decay(closed_form(0.15, 230, 2e-3, seed), settings_of(230)).damping_ratio;
    sum += z.value;
    squares += z.value * z.value;
    stated += z.standard_error / runs;
  }
  const double mean = sum / runs, scatter = std::sqrt((squares - runs * mean * mean) / (runs - 1));
  EXPECT_NEAR(scatter / stated, 1, 0.4);  // 3.5 times the 11 % that 40 runs leave
  EXPECT_NEAR(mean, 0.15, 3.5 * scatter / std::sqrt(runs));
}

TEST(Decay, TheRigOfTheThesisWithItsSensors) {
  for (const RingingSignal signal : {RingingSignal::speed_difference, RingingSignal::position_difference}) {
    const TwoMasses machine = square_wave(200, 1);
    DecaySettings settings = settings_of(machine);
    settings.signal = signal;
    const DecayIdentification d = identify_decay(simulate(machine, 6), settings);
    EXPECT_GE(d.ringings.size(), 10u);
    // Five deviations, and 0.2 % for what the misfit of 1 % of the amplitude lets through.
    const double tolerance = 5 * d.damping.standard_error + 0.002 * machine.damping;
    EXPECT_NEAR(d.damping.value, machine.damping, tolerance);
    EXPECT_LT(tolerance, 0.01 * machine.damping);
    EXPECT_NEAR(d.natural_frequency.value, machine.natural_frequency(), 0.002 * machine.natural_frequency());
    EXPECT_NEAR(d.peak_damping_ratio.value, machine.damping_ratio(), 0.03 * machine.damping_ratio());
    for (const Ringing& r : d.ringings) {
      EXPECT_EQ(r.time.size(), r.fitted.size());
      EXPECT_GT(r.amplitude, 5 * r.deviation);
    }
  }
}

TEST(Decay, BearingDampingIsTakenOff) {
  TwoMasses machine = square_wave(200, 1);
  machine.motor_viscous = 13;
  machine.load_viscous = 7;
  DecaySettings settings = settings_of(machine);
  const double raw = identify_decay(simulate(machine, 6), settings).damping.value;
  // The part of the ringing that each body has: Jp / J1 and Jp / J2.
  const double jp = machine.reduced_inertia();
  settings.bearing_damping = jp * jp * (13 / (8.4 * 8.4) + 7 / (40.5 * 40.5));
  EXPECT_NEAR(raw, machine.damping + settings.bearing_damping, 0.004 * machine.damping);
  EXPECT_GT(settings.bearing_damping, 0.016 * machine.damping);
  EXPECT_NEAR(identify_decay(simulate(machine, 6), settings).damping.value, raw - settings.bearing_damping,
              1e-9);
}

TEST(Decay, PassagesOfTheGapServeWithoutATorque) {
  const TwoMasses machine = square_wave(200, 1);
  record::Record record = simulate(machine, 4);
  record.column(record::Channel::motor_torque).clear();
  record.column(record::Channel::motor_velocity).clear();
  const DecayIdentification d = identify_decay(record, settings_of(machine));
  EXPECT_EQ(d.signal, RingingSignal::position_difference);
  EXPECT_GE(d.ringings.size(), 5u);
  EXPECT_NEAR(d.damping.value, machine.damping, 0.01 * machine.damping);
}

TEST(Decay, LostContactIsNotUsed) {
  const TwoMasses machine = square_wave(300, 0.5, 50);  // bounces several times
  const record::Record record = simulate(machine, 4, kPerfect);
  const DecayIdentification d = identify_decay(record, settings_of(machine));
  EXPECT_NEAR(d.damping.value, machine.damping, 1e-3 * machine.damping);
  const auto& motor = record.column(record::Channel::motor_position);
  const auto& load = record.column(record::Channel::load_position);
  const auto in_contact = [&](double t) {
    const auto i = std::size_t(std::lround(1000 * t));
    return std::fabs(motor[i] - load[i]) > machine.gap(0) / 2;
  };
  int lost = 0;
  for (const Ringing& r : d.ringings) {
    for (const double t : r.time) EXPECT_TRUE(in_contact(t)) << t;
    for (double t = r.time[0] - 0.14; t < r.time[0]; t += 1e-3) lost += !in_contact(t);
  }
  EXPECT_GT(lost, 8 * int(d.ringings.size()));  // it did bounce before
  // The first stretch, begun 60 ms too early, gives something else.
  const auto from = std::size_t(std::lround(1000 * d.ringings[0].time[0])) - 60;
  std::vector<double> time, speed;
  for (std::size_t i = from; i < from + 140; ++i) {
    time.push_back(record.time[i]);
    speed.push_back(record.column(record::Channel::motor_velocity)[i] -
                    record.column(record::Channel::load_velocity)[i]);
  }
  EXPECT_GT(std::fabs(fit_ringing(time, speed, machine.natural_frequency()).damping_ratio.value /
                          machine.damping_ratio() -
                      1),
            0.1);
}

TEST(Decay, WrongStiffnessIsReported) {
  const TwoMasses machine = square_wave(200, 1);
  DecaySettings settings = settings_of(machine);
  settings.stiffness.value *= 1.3;
  const DecayIdentification d = identify_decay(simulate(machine, 4), settings);
  ASSERT_EQ(d.warnings.size(), 1u);
  EXPECT_NE(d.warnings[0].find("Hz"), std::string::npos);
  EXPECT_NEAR(d.damping_by_rate.value, machine.damping, 0.01 * machine.damping);  // does not need it
}

TEST(Decay, WhatIsNotDeterminedIsRefused) {
  const DecaySettings settings = settings_of(230);
  EXPECT_THROW(identify_decay(closed_form(0.15, 230, 0.2, 1), settings),
               CannotIdentify);  // below the noise
  EXPECT_THROW(identify_decay(closed_form(0.15, 230, 0, 1, 2), settings),
               CannotIdentify);  // two steps
  EXPECT_THROW(identify_decay(closed_form(0.15, 100, 0, 1), settings),
               CannotIdentify);  // rings elsewhere
  record::Record record = closed_form(0.15, 230, 0, 1);
  record.column(record::Channel::load_velocity).clear();
  EXPECT_THROW(identify_decay(record, settings), CannotIdentify);
  DecaySettings bad = settings;
  bad.stiffness.value = 0;
  EXPECT_THROW(identify_decay(record, bad), InvalidParameter);
  bad = settings;
  bad.shortest = 0.5;
  EXPECT_THROW(identify_decay(record, bad), InvalidParameter);
}

}  // namespace
}  // namespace backlash::identification
