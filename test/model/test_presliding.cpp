// SPDX-License-Identifier: BSD-3-Clause
// Dahl's law by hand, as a differential equation, and as loops.
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/presliding.h"

namespace backlash::model {
namespace {

constexpr double kDistance = 2e-3;                 // rad
const FrictionLimits kLimits{3, 2, kDistance};     // N m
constexpr double kStiffest = (3 + 2) / kDistance;  // N m/rad

/// Friction after a way from where it was `start`, by small steps of dF = dx (F_c - F s) / x_s and Heun's
/// rule.
double integrated(double start, double way) {
  const int steps = 20000;
  const int direction = way > 0 ? 1 : -1;
  const double dx = way / steps, limit = way > 0 ? 3 : 2;
  const auto slope = [&](double f) { return (limit - direction * f) / kDistance; };
  double f = start;
  for (int i = 0; i < steps; ++i) {
    const double ahead = f + dx * slope(f);
    f += 0.5 * dx * (slope(f) + slope(ahead));
  }
  return f;
}

TEST(Presliding, FrictionFromRestByHand) {
  const Presliding fresh(0.5);
  EXPECT_EQ(fresh.friction(1, kLimits, 0.5), 0);
  EXPECT_EQ(fresh.friction(0, kLimits, 0.7), 0);
  EXPECT_NEAR(fresh.friction(1, kLimits, 0.5 + kDistance), 3 * (1 - std::exp(-1.0)),
              1e-12);  // roundings of 0.5
  EXPECT_NEAR(fresh.friction(-1, kLimits, 0.5 - 2 * kDistance), -2 * (1 - std::exp(-2.0)), 1e-12);
  EXPECT_EQ(fresh.friction(1, kLimits, 1), 3);
  EXPECT_EQ(fresh.friction(-1, kLimits, 0), -2);
  const Presliding turned(0.5, 3);
  EXPECT_NEAR(turned.friction(-1, kLimits, 0.5 - kDistance), -2 + 5 * std::exp(-1.0), 1e-12);
}

// Also behind the turn, where only a solver on trial looks: no jump, no kink, no overflow.
TEST(Presliding, SmoothThroughItsTurn) {
  const double d = 1e-7;
  for (double start : {0.0, 1.7, -1.2})
    for (int direction : {1, -1}) {
      const Presliding memory(0, start);
      const double before = memory.friction(direction, kLimits, -d),
                   at = memory.friction(direction, kLimits, 0),
                   after = memory.friction(direction, kLimits, d);
      EXPECT_EQ(at, start);
      EXPECT_NEAR(after - 2 * at + before, 0, kStiffest * d * d / kDistance) << "the curvature on one side";
      EXPECT_NEAR((after - before) / (2 * d), ((direction > 0 ? 3 : 2) - direction * start) / kDistance,
                  kStiffest * d / kDistance);
      EXPECT_TRUE(std::isfinite(memory.friction(direction, kLimits, -direction * 1e9)));
    }
}

// Positions that end on their turning points.
TEST(Presliding, AlongSamplesItSolvesTheDifferentialEquation) {
  const std::vector<double> q = {0.1, 0.1,    0.1004, 0.1011, 0.1011, 0.1002,
                                 0.1, 0.1009, 0.14,   0.1395, 0.12,   0.1201};
  const std::vector<double> rates = {0, 0, 1, 2, 0, -1, -2, 1, 3, -1, -4, 1};
  const auto friction = presliding_friction(q, std::vector<FrictionLimits>(q.size(), kLimits), rates);
  double f = 0;
  for (std::size_t k = 0; k < q.size(); ++k) {
    if (k > 0 && q[k] != q[k - 1]) f = integrated(f, q[k] - q[k - 1]);
    EXPECT_NEAR(friction[k], f, 2e-6) << k;  // Heun: F_c (dx / x_s)^2 / 6 at the longest way, 1e-3 of x_s
  }
}

// A sine sampled anywhere turns between samples; the rates say where.
TEST(Presliding, BetweenSamplesTheTurnIsFound) {
  const double interval = 1e-3, w = 2 * M_PI * 3, amplitude = 4e-3;
  const auto q = [&](double t) { return amplitude * std::sin(w * t); };
  std::vector<double> positions, rates;
  for (int k = 0; k < 1000; ++k) {
    positions.push_back(q(k * interval));
    rates.push_back(amplitude * w * std::cos(w * k * interval));
  }
  const std::vector<FrictionLimits> limits(positions.size(), kLimits);
  const auto found = presliding_friction(positions, limits, rates, interval);
  const auto not_found = presliding_friction(positions, limits, rates);
  double f = 0, last = 0, worst = 0, worst_without = 0;
  int turns = 0;
  for (std::size_t k = 1; k < positions.size(); ++k) {
    const double t = k * interval, turn = (turns + 0.5) * M_PI / w;
    if (turn <= t) {
      f = integrated(f, q(turn) - last);
      last = q(turn);
      ++turns;
    }
    f = integrated(f, positions[k] - last);
    last = positions[k];
    worst = std::max(worst, std::fabs(found[k] - f));
    worst_without = std::max(worst_without, std::fabs(not_found[k] - f));
  }
  const double sagitta = amplitude * w * w * interval * interval / 8;
  // The speed is linear to (w T)^2 / 24 about the turn.
  EXPECT_LT(worst, kStiffest * sagitta * w * w * interval * interval + 1e-6);
  EXPECT_GT(worst_without, 0.3 * kStiffest * sagitta) << "or the test shows nothing";
}

/// Friction of a body moved to and fro by +-`amplitude` until the loop repeats, and its area by trapezia.
struct Loop {
  double top = 0, bottom = 0, area = 0;
  explicit Loop(double amplitude) {
    std::vector<double> positions, rates;
    const int half = 4000, cycles = 200;
    for (int k = 0; k <= cycles * 2 * half; ++k) {
      const int phase = k % (2 * half);
      positions.push_back(amplitude * (phase < half ? phase : 2 * half - phase) / half);
      rates.push_back(phase > 0 && phase <= half ? 1 : -1);
    }
    rates.front() = 1;
    const auto f =
        presliding_friction(positions, std::vector<FrictionLimits>(positions.size(), kLimits), rates);
    const std::size_t last = positions.size() - 1;
    for (std::size_t k = last - 2 * half; k < last; ++k)
      area += 0.5 * (f[k] + f[k + 1]) * (positions[k + 1] - positions[k]);
    bottom = f[last], top = f[last - half];
  }
};

// Over an amplitude d = D / x_s the closed loop between F1 and F2 has 3 - F2 = (3 - F1) e^-d and
// 2 + F1 = (2 + F2) e^-d, and each half loses or gains limit * D less its change of friction times x_s; so
// the area is (3 + 2) D - 2 x_s (F2 - F1).
TEST(Presliding, TheLoopHasItsAreaAndOnlyDissipates) {
  for (double amplitude : {0.05 * kDistance, kDistance, 5 * kDistance}) {
    const Loop loop(amplitude);
    const double e = std::exp(-amplitude / kDistance), span = 5 * (1 - e) / (1 + e);
    EXPECT_NEAR(loop.top - loop.bottom, span, 1e-8);
    EXPECT_NEAR(loop.top + loop.bottom, 1,
                1e-8);  // 3 - 2; at the smallest the loop is not yet closed to more
    const double area = 5 * amplitude - 2 * kDistance * span;
    EXPECT_NEAR(loop.area, area, 1e-4 * area);  // trapezia
    EXPECT_GT(area, 0);
  }
}

TEST(Presliding, WithoutADistanceItIsCoulombs) {
  const FrictionLimits coulomb{3, 2};
  const auto f =
      presliding_friction({0, 0, 1, 1, 0, 0}, std::vector<FrictionLimits>(6, coulomb), {0, 0, 1, 0, -1, 0});
  EXPECT_EQ(f, (std::vector<double>{0, 0, 3, 3, -2, -2}));
  EXPECT_TRUE(presliding_friction({}, {}, {}).empty());
  EXPECT_THROW(presliding_friction({0, 1}, {coulomb}, {0, 0}), InvalidParameter);
  EXPECT_THROW(presliding_friction({0}, {coulomb}, {}), InvalidParameter);
}

TEST(Presliding, ABodyTurnsOnceWhereItsSpeedCrossesZero) {
  StickSlip mode;
  double speed = 0.2;
  mode.begin(-1, speed, kLimits, 0.3);
  EXPECT_EQ(mode.direction(), 1);
  EXPECT_EQ(speed, 0.2);
  EXPECT_EQ(mode.torque(kLimits, 0.3), 0);
  const double place = 0.3 + kDistance, built_up = 3 * (1 - std::exp(-1.0));
  EXPECT_NEAR(mode.torque(kLimits, place), -built_up, 1e-12);
  EXPECT_FALSE(mode.update(-9, speed, kLimits, place)) << "still on its way";
  EXPECT_LT(mode.event(-9, speed, kLimits), 0);
  speed = -1e-18;
  EXPECT_GT(mode.event(-9, speed, kLimits), 0);
  EXPECT_TRUE(mode.update(-9, speed, kLimits, place));
  EXPECT_EQ(mode.direction(), -1);
  EXPECT_EQ(speed, -1e-18) << "it goes on";
  EXPECT_NEAR(mode.torque(kLimits, place), -built_up, 1e-12) << "no jump";
  EXPECT_FALSE(mode.update(-9, speed, kLimits, place));
  speed = 0.3;
  EXPECT_TRUE(mode.update(-9, speed, kLimits, place)) << "turned by an impact";
  EXPECT_EQ(mode.direction(), 1);
  EXPECT_EQ(speed, 0.3);
}

TEST(Presliding, AtRestInBalanceItSticksUntilTheTorqueChanges) {
  StickSlip mode;
  double speed = 0;
  mode.begin(0, speed, kLimits, 0.3);
  EXPECT_TRUE(mode.stuck());
  EXPECT_LT(mode.event(0, 0, kLimits), 0);
  EXPECT_FALSE(mode.update(9e-6, speed, kLimits, 0.3));  // twice 1e-6 (3 + 2)
  EXPECT_LT(mode.event(9e-6, 0, kLimits), 0);
  EXPECT_GT(mode.event(-1.1e-5, 0, kLimits), 0);
  EXPECT_TRUE(mode.update(-1.1e-5, speed, kLimits, 0.3));
  EXPECT_EQ(mode.direction(), -1);
  const double place = 0.3 - kDistance, built_up = 2 * (1 - std::exp(-1.0));
  EXPECT_NEAR(mode.torque(kLimits, place), built_up, 1e-12);
  speed = 1e-18;
  EXPECT_TRUE(mode.update(-built_up + 1e-6, speed, kLimits, place));
  EXPECT_TRUE(mode.stuck());
  EXPECT_EQ(speed, 0);
  EXPECT_TRUE(mode.update(0, speed, kLimits, place)) << "let go it is pushed back";
  EXPECT_EQ(mode.direction(), 1);
  EXPECT_NEAR(mode.torque(kLimits, place), built_up, 1e-12) << "from where it was";
  mode.begin(-1, speed, kLimits, place);
  EXPECT_EQ(mode.direction(), -1);
  EXPECT_EQ(mode.torque(kLimits, place), 0);
}

// The solver multiplies values at both ends of a step.
TEST(Presliding, EventsDoNotUnderflow) {
  StickSlip mode;
  double speed = 1;
  mode.begin(0, speed, kLimits);
  for (double tiny : {0.0, 1e-200, 1e-310}) EXPECT_EQ(mode.event(0, tiny, kLimits), -1e-100);
  EXPECT_EQ(mode.event(0, -1e-310, kLimits), 1e-100);
}

TEST(Presliding, TheTermSetsTheDistanceOfItsBody) {
  for (const char* body : {"motor", "load"}) {
    const auto term = read_term(YamlReader::from_text(
        std::string("{id: presliding, body: ") + body + ", distance: 0.01, damping: 3}", "rig.yaml"));
    EndFriction friction{{1, 2}, {3, 4}};
    EXPECT_TRUE(term->has_dry_friction());
    term->add_friction({}, friction);
    const bool motor = std::string(body) == "motor";
    EXPECT_EQ(friction.motor.presliding, motor ? 0.01 : 0);
    EXPECT_EQ(friction.load.presliding, motor ? 0 : 0.01);
    EXPECT_EQ(friction.motor.forward, 1);
    EXPECT_EQ(term->moves_load(), !motor);
  }
  EXPECT_THROW(read_term(YamlReader::from_text("{id: presliding, body: gear, distance: 0.01, damping: 3}",
                                               "rig.yaml")),
               BadData);
  EXPECT_THROW(
      read_term(YamlReader::from_text("{id: presliding, body: load, distance: -1, damping: 3}", "rig.yaml")),
      BadData);
  const TermSearch& search = *term_type("presliding").search;
  MotionRange range;
  range.from = -1, range.to = 2;
  EXPECT_EQ(search.strength, "distance");
  EXPECT_DOUBLE_EQ(search.typical(range), 0.03);
}

}  // namespace
}  // namespace backlash::model
