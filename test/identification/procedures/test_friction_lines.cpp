// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/identification/procedures/friction_lines.h"

namespace backlash::identification {
namespace {

constexpr double kDegree = M_PI / 180;

struct PrintedRow {
  double speed, torque;  // deg/s, N m
  double residual;       // N m, of the line, worked out independently (two decimals)
};

// Yumrukcal (2013), Table B.3: total friction, configuration 1.
const std::vector<PrintedRow> kTableB3 = {
    {-90.03, -105.4, 6.41}, {-80.01, -112.9, -4.86}, {-50.00, -97.7, -0.97}, {-40.00, -94.3, -1.34},
    {-39.99, -95.3, -2.35}, {-29.99, -90.6, -1.42},  {-19.99, -85.9, -0.48}, {-19.99, -84.4, 1.02},
    {-10.00, -80.5, 1.15},  {-9.99, -78.8, 2.85},    {10.00, 80.6, -1.92},   {10.01, 80.1, -2.42},
    {19.99, 87.2, 1.54},    {19.99, 85.7, 0.04},     {29.99, 89.3, 0.49},    {39.99, 92.7, 0.75},
    {40.00, 95.2, 3.25},    {50.00, 95.7, 0.60},     {80.02, 102.9, -1.64},  {90.05, 107.0, -0.69}};

ConstantSpeedRun row(double speed, double torque, double error = std::nan("")) {
  return {{speed, 0}, {torque, error}, 0, 0};
}

std::vector<ConstantSpeedRun> table(double without = 0) {
  std::vector<ConstantSpeedRun> rows;
  for (const auto& r : kTableB3)
    if (r.speed != without) rows.push_back(row(r.speed * kDegree, r.torque));
  return rows;
}

void expect_line(const FrictionLine& line, double a, double b, double rms, double c, double t) {
  // Half of the last printed digit.
  EXPECT_NEAR(line.coulomb.value, a, 0.005);
  EXPECT_NEAR(line.viscous.value, b, 0.005);
  EXPECT_NEAR(line.rms, rms, 0.005);
  EXPECT_NEAR(line.quadratic, c, 0.005);
  EXPECT_NEAR(line.quadratic_t, t, 0.05);
}

bool mentions(const std::vector<std::string>& warnings, const std::string& text) {
  for (const auto& w : warnings)
    if (w.find(text) != std::string::npos) return true;
  return false;
}

TEST(FrictionLine, RefitsThePrintedTable) {
  const FrictionLine up = fit_friction_line(table(), Direction::positive);
  const FrictionLine down = fit_friction_line(table(), Direction::negative);
  expect_line(up, 79.38, 18.01, 1.64, -6.64, -3.0);
  expect_line(down, -77.88, 21.59, 2.93, 10.46, 2.3);
  ASSERT_EQ(up.residual.size(), 10u);
  ASSERT_EQ(down.residual.size(), 10u);
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(down.residual[i], kTableB3[i].residual, 0.0051) << i;
    EXPECT_NEAR(up.residual[i], kTableB3[10 + i].residual, 0.0051) << i;
  }
}

TEST(FrictionLine, RootFitsTheFastRunsBetter) {
  const FrictionLine up = fit_friction_line(table(), Direction::positive);
  EXPECT_NEAR(up.root_a, 67.9, 0.05);
  EXPECT_NEAR(up.root_b, 30.5, 0.05);
  EXPECT_NEAR(up.root_rms, 0.92, 0.005);
  EXPECT_TRUE(mentions(up.warnings, "concave"));
}

TEST(FrictionLine, TheTwoFastestReverseRunsContradictEachOther) {
  expect_line(fit_friction_line(table(-90.03), Direction::negative), -75.57, 26.80, 0.88, 1.54, 0.7);
  expect_line(fit_friction_line(table(-80.01), Direction::negative), -78.86, 19.07, 2.35, 11.64, 8.9);
  EXPECT_TRUE(mentions(fit_friction_line(table(), Direction::negative).warnings, "-1.57 rad/s"));
}

TEST(FrictionLine, AStraightLineRarelyWarns) {
  Random random(4);
  int warned = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    std::vector<ConstantSpeedRun> rows;
    for (const double w : {0.17, 0.35, 0.52, 0.7, 0.87, 1.4, 1.57})
      rows.push_back(row(w, 79 + 18 * w + 0.01 * random.normal(), 0.01));
    warned += !fit_friction_line(rows, Direction::positive).warnings.empty();
  }
  // Three tests at 1 % (quadratic, root, rows): 30 at most where they were independent, and three deviations.
  EXPECT_LT(warned, 30 + 3 * std::sqrt(30));
  EXPECT_GT(warned, 5);  // and not for lack of attention
}

TEST(FrictionLine, StatedErrorsOfTheRowsAreWeights) {
  // Two rows on a line, the third off by 10 but with a hundred times the error: moves the line by 1e-3 only.
  const std::vector<ConstantSpeedRun> rows = {row(1, 2, 0.1), row(2, 3, 0.1), row(3, 14, 10)};
  const FrictionLine line = fit_friction_line(rows, Direction::positive);
  EXPECT_NEAR(line.viscous.value, 1, 5e-3);  // weight ratio 1e-4 times the lever 1 / 0.5 times 10
  EXPECT_NEAR(line.viscous.standard_error, 0.1 * std::sqrt(2.0), 1e-3);
}

TEST(FrictionLine, StandardErrorsAreHonestForRowsThatScatterMoreThanTheySay) {
  Random random(3);
  double sum = 0, squares = 0, stated = 0;
  constexpr int kTrials = 1000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<ConstantSpeedRun> rows;
    for (int i = 1; i <= 10; ++i) rows.push_back(row(0.15 * i, 79 + 18 * 0.15 * i + random.normal(), 0.1));
    const FrictionLine line = fit_friction_line(rows, Direction::positive);
    sum += line.viscous.value;
    squares += std::pow(line.viscous.value - 18, 2);
    stated += std::pow(line.viscous.standard_error, 2);
  }
  EXPECT_NEAR(sum / kTrials, 18, 4 * std::sqrt(squares) / kTrials);  // four standard errors of the mean
  // Scatter of a variance from 1000 trials: sqrt(2 / 1000) = 4.5 %; three of it on each side.
  EXPECT_NEAR(squares / stated, 1, 0.15);
}

TEST(FrictionLine, RefusesWhatHoldsNoLine) {
  const std::vector<ConstantSpeedRun> one = {row(1, 2, 0.1), row(1.005, 2.1, 0.1), row(-1, -3, 0.1)};
  EXPECT_THROW(fit_friction_line(one, Direction::positive), CannotIdentify);
  EXPECT_THROW(fit_friction_line(one, Direction::negative), CannotIdentify);
  EXPECT_THROW(fit_friction_line({}, Direction::negative), CannotIdentify);
  EXPECT_THROW(fit_friction_line({row(1, 2), row(2, 3)}, Direction::positive), CannotIdentify);
  EXPECT_NO_THROW(fit_friction_line({row(1, 2, 0.1), row(2, 3, 0.1)}, Direction::positive));
}

struct Drive {
  double coulomb = 79.4, viscous = 18, inertia = 49;  // N m, N m s/rad, kg m^2
  double ripple = 20, noise = 1;                      // N m: periodic, first order with 50 ms memory
};

// Constant speeds of 5 s each, ramps of 0.5 s between them, 500 Hz.
record::Record staircase(const std::vector<double>& speeds, unsigned seed, const Drive& drive = {}) {
  Random random(seed);
  record::Record record;
  record.name = "staircase";
  constexpr double kRate = 500, kStay = 5, kRamp = 0.5;
  double before = 0, coloured = 0;
  const double keep = std::exp(-1 / (0.05 * kRate));
  for (const double target : speeds) {
    for (int i = 0; i < int((kStay + kRamp) * kRate); ++i) {
      const double t = record.time.size() / kRate, u = std::min(1.0, i / (kRamp * kRate));
      const double w = before + u * (target - before), a = u < 1 ? (target - before) / kRamp : 0;
      coloured = keep * coloured + std::sqrt(1 - keep * keep) * drive.noise * random.normal();
      record.time.push_back(t);
      record.column(record::Channel::motor_velocity).push_back(w + 2e-3 * std::sin(2 * M_PI * 7.3 * t));
      const double sign = (w > 0) - (w < 0);
      record.column(record::Channel::motor_torque)
          .push_back(drive.inertia * a + drive.viscous * w + drive.coulomb * sign +
                     drive.ripple * std::sin(2 * M_PI * 7.3 * t) + coloured);
    }
    before = target;
  }
  return record;
}

TEST(ConstantSpeed, FindsTheStretchesOfBothSigns) {
  const std::vector<double> speeds = {0.5, 1.0, 0, -0.2, -1.5};
  const auto runs = find_constant_speed(staircase(speeds, 1));
  ASSERT_EQ(runs.size(), 4u);
  const std::vector<double> expected = {0.5, 1.0, -0.2, -1.5}, begins = {0.5, 6, 17, 22.5};
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(runs[i].speed.value, expected[i], 2e-4);  // ripple 2e-3 over 30 cycles that need not be whole
    EXPECT_GE(runs[i].from, begins[i]);
    EXPECT_LE(runs[i].to, begins[i] + 5);
    EXPECT_GT(runs[i].to - runs[i].from, 3.9);  // but for blocks of 0.25 s at both ends and their raster
    const double torque = 79.4 * (expected[i] > 0 ? 1 : -1) + 18 * expected[i];
    EXPECT_NEAR(runs[i].torque.value, torque, 4 * runs[i].torque.standard_error);
  }
}

TEST(ConstantSpeed, StandardErrorsAreHonestForCorrelatedTorque) {
  double squares = 0, stated = 0;
  int count = 0;
  Drive drive;
  drive.ripple = 0;
  for (unsigned seed = 0; seed < 60; ++seed)
    for (const auto& run : find_constant_speed(staircase({0.5, 1.0}, seed, drive))) {
      const double truth = run.speed.value > 0.75 ? 97.4 : 88.4;
      squares += std::pow(run.torque.value - truth, 2);
      stated += std::pow(run.torque.standard_error, 2);
      ++count;
    }
  ASSERT_EQ(count, 120);
  // Batches of 0.4 s with a memory of 0.05 s lose an eighth of the variance; 120 runs scatter by
  // sqrt(2 / 120 + 2 / 9 / 120) = 14 %: two and a half of that beside it.
  EXPECT_NEAR(squares / stated, 1.07, 0.35);
}

TEST(ConstantSpeed, PositionServesWithoutSpeed) {
  record::Record record = staircase({0.5, -0.5}, 2);
  auto& speed = record.column(record::Channel::motor_velocity);
  auto& position = record.column(record::Channel::motor_position);
  double x = 0;
  for (const double w : speed) position.push_back(x += w / 500);
  speed.clear();
  const auto runs = find_constant_speed(record);
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_NEAR(runs[1].speed.value, -0.5, 2e-4);
}

TEST(ConstantSpeed, RefusesARecordWithoutIt) {
  record::Record sine;
  sine.name = "sine";
  for (int i = 0; i < 5000; ++i) {
    sine.time.push_back(i * 2e-3);
    sine.column(record::Channel::motor_velocity).push_back(1 + 0.5 * std::sin(i * 2e-3));
    sine.column(record::Channel::motor_torque).push_back(1);
  }
  EXPECT_THROW(find_constant_speed(sine), CannotIdentify);
  sine.column(record::Channel::motor_velocity).clear();
  EXPECT_THROW(find_constant_speed(sine), CannotIdentify);
  ConstantSpeedOptions options;
  options.block = 0;
  EXPECT_THROW(find_constant_speed(sine, options), InvalidParameter);
}

}  // namespace
}  // namespace backlash::identification
