// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/identification/procedures/gap_map.h"
#include "support/two_mass.h"

namespace backlash::identification {
namespace {

constexpr double kTurn = 2 * M_PI;
const double kMotorStep = 0.0055 / 110 * M_PI / 180, kLoadStep = 0.0004 * M_PI / 180;

struct Recipe {
  double gap = 4.4e-4, first = 0.1, second = 0.05;  // gap (1 + first sin(3 q + 0.7) + second sin(5 q - 1.1))
  double wind_up = 0;                               // rad, each way
  double scale = 1;                                 // of the motor's position
  double speed = 0.3, turns = 1.3, start = 0.4;     // rad/s, -, rad
  double noise = 5e-6;                              // rad
  unsigned seed = 1;

  double at(double q) const {
    return gap * (1 + first * std::sin(3 * q + 0.7) + second * std::sin(5 * q - 1.1));
  }
  double centre(double q) const { return 3e-4 * std::sin(q + 2) + 5e-5 * std::sin(18.7 * q); }
};

/// A run as a formula, with the sensors of the thesis; speed < 0: reverse, from the far end.
record::Record run(const Recipe& r, double speed) {
  record::Record record;
  Random random(r.seed + (speed > 0 ? 0 : 1000));
  const double sign = speed > 0 ? 1 : -1;
  const int samples = int(r.turns * kTurn / std::fabs(speed) * 1000);
  for (int i = 0; i < samples; ++i) {
    const double travel = std::fabs(speed) * 1e-3 * i;
    const double q = sign > 0 ? r.start + travel : r.start + r.turns * kTurn - travel;
    const double motor = r.scale * (q + r.centre(q) + sign * (r.at(q) / 2 + r.wind_up) + 0.01);
    record.time.push_back(1e-3 * i);
    record.column(record::Channel::motor_position)
        .push_back(kMotorStep * std::round((motor + r.noise * random.normal()) / kMotorStep));
    record.column(record::Channel::load_position).push_back(kLoadStep * std::round(q / kLoadStep));
  }
  return record;
}

GapMap map_of(const Recipe& r, const GapMapSettings& settings = {}) {
  return identify_gap_map(run(r, r.speed), run(r, -r.speed), settings);
}

TEST(GapMap, SeriesOfAKnownGapIsFound) {
  Recipe r;
  r.wind_up = 15.0 / 355e3;
  r.scale = 1.0003;
  GapMapSettings settings;
  settings.stiffness = {355e3, 3.55e3};
  settings.friction_forward = {15, 0.5};
  settings.friction_reverse = {15, 0.5};
  const GapMap map = map_of(r, settings);
  EXPECT_EQ(map.bins.size(), 180u);
  EXPECT_EQ(map.coverage, 1);
  ASSERT_EQ(map.harmonics.size(), 2u);
  const double order[] = {3, 5}, amplitude[] = {0.1 * r.gap, 0.05 * r.gap}, phase[] = {0.7, -1.1};
  for (int i = 0; i < 2; ++i) {
    const Harmonic& h = map.harmonics[i];
    EXPECT_EQ(h.order, order[i]);
    // Four deviations, and what the scale of 3e-4 does to the gap.
    EXPECT_NEAR(h.amplitude.value, amplitude[i], 4 * h.amplitude.standard_error + 3e-4 * amplitude[i]);
    EXPECT_NEAR(h.phase.value, phase[i], 4 * h.phase.standard_error + 1e-4);
    EXPECT_LT(h.amplitude.standard_error, 0.01 * amplitude[i]);
  }
  EXPECT_NEAR(map.mean_separation.value, r.gap + 2 * r.wind_up,
              4 * map.mean_separation.standard_error + 3e-4 * r.gap);
  EXPECT_NEAR(map.mean_gap.value, r.gap, 4 * map.mean_separation.standard_error + 3e-4 * r.gap);
  EXPECT_NEAR(map.wind_up.value, 2 * r.wind_up, 1e-12);
  // 0.5 N m each way and 1 % of stiffness: hypot(0.707 / 355e3, 0.01 30 / 355e3).
  EXPECT_NEAR(map.wind_up.standard_error, std::hypot(std::sqrt(0.5), 0.3) / 355e3, 1e-10);
  EXPECT_GE(map.mean_gap.standard_error, map.wind_up.standard_error);
  for (double q = 0; q < kTurn; q += 0.1) EXPECT_NEAR(map.gap_at(q), r.at(q), 0.005 * r.gap) << q;
  EXPECT_TRUE(map.varies);
  EXPECT_GT(map.confidence, 0.999);
  EXPECT_NE(map.statement.find("varies"), std::string::npos);
  // Orders beyond the sixth of the centre line, 5e-5 rad over 8.2 rad of travel.
  EXPECT_NEAR(map.scale.value, 1.0003, 2e-5);
  EXPECT_NEAR(map.scale.value, 1.0003, 4 * map.scale.standard_error);
  EXPECT_TRUE(map.warnings.empty());
}

TEST(GapMap, CentreLineIsTheMeanOfBothFlanks) {
  Recipe r;
  r.turns = 1;
  r.scale = 1.001;
  const GapMap map = map_of(r);
  double mean = 0;
  for (const GapBin& b : map.bins) mean += (b.centre.value - r.centre(b.position)) / 180;
  for (const GapBin& b : map.bins)
    if (b.position >
        r.start + 0.02) {  // before it lies the end of the turn, where order 18.7 has another phase
      // It leaves a slope: 4 deviations over half a turn.
      EXPECT_NEAR(b.centre.value - r.centre(b.position), mean, 4 * map.scale.standard_error * kTurn / 2)
          << b.position;
    }
  // Order 18.7 is no harmonic of the turn: 3.5e-5 rad rms, alike over some five bins of 180, which leave of a
  // slope 3.5e-5 sqrt(12 / 36) / (2 pi) = 3.2e-6, and more through the orders that are fitted beside it.
  EXPECT_LT(map.scale.standard_error, 4e-5);
  EXPECT_GT(map.warnings.size(), 0u);  // no stiffness given
  EXPECT_TRUE(std::isnan(map.mean_gap.value));
}

TEST(GapMap, FlatGapIsReportedFlat) {
  int alarms = 0;
  const int runs = 40;
  for (int seed = 0; seed < runs; ++seed) {
    Recipe r;
    r.first = r.second = 0;
    r.speed = 1;
    r.turns = 1;
    r.seed = seed;
    const GapMap map = map_of(r);
    alarms += map.varies;
    if (!map.varies) {
      EXPECT_LT(map.confidence, 0.99);
      EXPECT_NE(map.statement.find("no variation"), std::string::npos);
    }
    EXPECT_NEAR(map.mean_separation.value, r.gap, 5 * map.mean_separation.standard_error);
  }
  EXPECT_LE(alarms, 3);  // 0.4 expected at a false alarm of 1 %; 4 or more has a chance of 1e-3
}

TEST(GapMap, StandardErrorsAreThoseOfTheScatter) {
  const int runs = 40;
  double scatter = 0, stated = 0, bin_scatter = 0, bin_stated = 0, amplitude = 0, amplitude_stated = 0;
  for (int seed = 0; seed < runs; ++seed) {
    Recipe r;
    r.speed = 1;
    r.turns = 1;
    r.seed = 100 + seed;
    const GapMap map = map_of(r);
    ASSERT_GE(map.harmonics.size(), 2u);
    scatter += std::pow(map.mean_separation.value - r.gap, 2) / runs;
    stated += std::pow(map.mean_separation.standard_error, 2) / runs;
    const Harmonic& h = map.harmonics[0];
    amplitude += std::pow(h.amplitude.value - 0.1 * r.gap, 2) / runs;
    amplitude_stated += std::pow(h.amplitude.standard_error, 2) / runs;
    for (const GapBin& b : map.bins) {
      bin_scatter += std::pow(b.separation.value - r.at(b.position), 2);
      bin_stated += std::pow(b.separation.standard_error, 2);
    }
  }
  EXPECT_NEAR(std::sqrt(scatter / stated), 1, 0.4);  // 3.5 times the 11 % that 40 runs leave
  EXPECT_NEAR(std::sqrt(amplitude / amplitude_stated), 1, 0.4);
  EXPECT_NEAR(std::sqrt(bin_scatter / bin_stated), 1,
              0.1);  // 7200 bins leave 1 %; the rest is the line in a bin
}

TEST(GapMap, OversampledPlacesDoNotRuleTheMean) {
  Recipe r;
  r.first = 0.3;
  r.second = 0;
  r.start = -0.7 / 3;  // a sixth of a turn twice, where the gap is wide
  r.turns = 7.0 / 6;
  const GapMap map = map_of(r);
  EXPECT_EQ(map.coverage, 1);
  // By time the mean would be off by 0.3 x 2 / pi / 7 = 2.7 %. Five deviations of 1e-5 rad over 20000
  // samples.
  EXPECT_NEAR(map.mean_separation.value, r.gap, 0.002 * r.gap);
}

TEST(GapMap, SimulatedRunsOfTheMachine) {
  test::TwoMasses machine;
  machine.load_viscous = 5;
  machine.gap = [](double q) { return 4.4e-4 * (1 + 0.15 * std::sin(2 * q + 0.5)); };
  const auto simulated = [&](double speed) {
    test::TwoMasses m = machine;
    m.motor_torque = [=](double t, double w) {
      return 300 * (std::min(1.0, t) * speed - w) + std::copysign(80, speed) + std::copysign(15, speed) +
             5 * speed;
    };
    m.load_position = speed > 0 ? 0 : kTurn + 0.5;
    return simulate(m, (kTurn + 0.5) / std::fabs(speed) + 2, {}, 2e-5).slice(2, 100);  // without the start
  };
  GapMapSettings settings;
  settings.stiffness.value = machine.stiffness;
  settings.friction_forward.value = settings.friction_reverse.value = 15 + 5 * 0.8;
  const GapMap map = identify_gap_map(simulated(0.8), simulated(-0.8), settings);
  EXPECT_EQ(map.coverage, 1);
  // The wind-up of 24 % is separated from the gap to 0.5 %.
  EXPECT_NEAR(map.mean_separation.value, 4.4e-4 + 2 * 19 / 355e3, 0.005 * 4.4e-4);
  EXPECT_NEAR(map.mean_gap.value, 4.4e-4, 0.005 * 4.4e-4);
  ASSERT_GE(map.harmonics.size(), 1u);
  EXPECT_EQ(map.harmonics[0].order, 2);
  EXPECT_NEAR(map.harmonics[0].amplitude.value, 0.15 * 4.4e-4, 0.02 * 0.15 * 4.4e-4);
}

TEST(GapMap, PartOfATurnIsSaid) {
  Recipe r;
  r.turns = 0.4;
  const GapMap map = map_of(r);
  EXPECT_NEAR(map.coverage, 0.4, 0.01);
  ASSERT_GE(map.warnings.size(), 1u);
  for (const Harmonic& h : map.harmonics) EXPECT_GE(h.order, 3);
  for (double q = r.start + 0.1; q < r.start + 0.4 * kTurn - 0.1; q += 0.1)
    EXPECT_NEAR(map.gap_at(q), r.at(q), 0.01 * r.gap) << q;
}

TEST(GapMap, WhatIsNotDeterminedIsRefused) {
  const Recipe r;
  const record::Record forward = run(r, r.speed), reverse = run(r, -r.speed);
  EXPECT_NO_THROW(identify_gap_map(reverse, forward));  // either order
  EXPECT_THROW(identify_gap_map(forward, forward), CannotIdentify);
  Recipe elsewhere = r;
  elsewhere.turns = 0.2;
  const record::Record here = run(elsewhere, r.speed);
  elsewhere.start += 2;
  EXPECT_THROW(identify_gap_map(here, run(elsewhere, -r.speed)), CannotIdentify);
  record::Record there_and_back = forward;
  const double end = there_and_back.time.back();
  for (std::size_t i = 0; i < reverse.size(); ++i) {
    there_and_back.time.push_back(end + 1e-3 * double(i + 1));
    for (const record::Channel c : {record::Channel::motor_position, record::Channel::load_position})
      there_and_back.column(c).push_back(reverse.column(c)[i]);
  }
  EXPECT_THROW(identify_gap_map(there_and_back, reverse), CannotIdentify);
  record::Record blind = forward;
  blind.column(record::Channel::load_position).clear();
  EXPECT_THROW(identify_gap_map(blind, reverse), CannotIdentify);
  GapMapSettings bad;
  bad.bins = 4;
  EXPECT_THROW(identify_gap_map(forward, reverse, bad), InvalidParameter);
  bad = {};
  bad.stiffness.value = -1;
  EXPECT_THROW(identify_gap_map(forward, reverse, bad), InvalidParameter);
}

}  // namespace
}  // namespace backlash::identification
