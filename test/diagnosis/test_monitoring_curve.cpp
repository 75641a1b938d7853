// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/monitoring_curve.h"
#include "support/curve.h"

namespace backlash::diagnosis {
namespace {

using test::linear_curve;

constexpr double kZ = 1.959964;  // 97.5 % quantile of the normal distribution

double sigma(int periods) {
  return std::hypot(test::kCurveBetween, test::kCurveWithin / std::sqrt(periods));
}
double backlash_at(double skewness) {
  return (skewness - test::kCurveStart) / test::kCurveSlope;
}
double skewness_at(double backlash) {
  return test::kCurveStart + test::kCurveSlope * backlash;
}

/// A curve through the given skewness values at 0, 1, 2, ... um.
MonitoringCurve curve_through(const std::vector<double>& means, double between) {
  MonitoringCurve curve = linear_curve();
  curve.points.clear();
  for (std::size_t i = 0; i < means.size(); ++i) {
    CurvePoint point;
    point.backlash = 1e-6 * i;
    point.signal_level = 0.05;
    point.cells.assign(2, SkewnessCell{means[i], between, 0});
    curve.points.push_back(point);
  }
  return curve;
}

/// Cells on the straight lines in the middle between the points.
std::vector<std::vector<SkewnessCell>> straight_middle(const MonitoringCurve& curve) {
  std::vector<std::vector<SkewnessCell>> middle;
  for (std::size_t i = 0; i + 1 < curve.points.size(); ++i) {
    middle.push_back(curve.points[i].cells);
    for (std::size_t level = 0; level < middle[i].size(); ++level)
      middle[i][level].mean = 0.5 * (middle[i][level].mean + curve.points[i + 1].cells[level].mean);
  }
  return middle;
}

TEST(MonitoringCurve, InvertsALinearCurveInClosedForm) {
  for (const int points : {2, 3, 21, 200})
    for (const int periods : {1, 5, 100})
      for (const double skewness : {3.9, 3.0, 2.123456789, 2.0}) {
        const Estimate e = linear_curve(points).invert(skewness, periods, 0);
        const double half = kZ * sigma(periods) / -test::kCurveSlope;
        ASSERT_EQ(e.status, Status::ok) << e.message;
        EXPECT_EQ(e.method, "apd_skewness");
        EXPECT_EQ(e.skewness, skewness);
        // 1e-12 m: rounding of quadratic equations with coefficients of size 1.
        EXPECT_NEAR(e.backlash, backlash_at(skewness), 1e-12);
        EXPECT_NEAR(e.lower, backlash_at(skewness) - half, 1e-12);
        EXPECT_NEAR(e.upper, backlash_at(skewness) + half, 1e-12);
        EXPECT_DOUBLE_EQ(e.backlash_angle, e.backlash * test::kCurveToAngle);
        EXPECT_DOUBLE_EQ(e.angle_lower, e.lower * test::kCurveToAngle);
        EXPECT_DOUBLE_EQ(e.angle_upper, e.upper * test::kCurveToAngle);
      }
}

// The scatter may be far smaller than the distance of the points.
TEST(MonitoringCurve, InvertsACurveWithoutScatter) {
  MonitoringCurve curve = linear_curve(3);
  for (CurvePoint& point : curve.points)
    for (SkewnessCell& cell : point.cells) cell.between = cell.within = 0;
  const Estimate e = curve.invert(3.777, 5, 0);
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_NEAR(e.backlash, backlash_at(3.777), 1e-12);
  // The smallest difference that counts is 1e-6 of skewness.
  EXPECT_NEAR(e.upper - e.lower, 2e-6 / -test::kCurveSlope, 1e-11);
}

TEST(MonitoringCurve, ScatterThatGrowsWithBacklash) {
  MonitoringCurve curve = linear_curve(2);
  for (SkewnessCell& cell : curve.points[1].cells) cell.between = 3 * test::kCurveBetween;
  for (CurvePoint& point : curve.points)
    for (SkewnessCell& cell : point.cells) cell.within = 0;
  const Estimate e = curve.invert(3.0, 1, 0);
  ASSERT_EQ(e.status, Status::ok) << e.message;
  // At the limits skewness is exactly 1.96 sigma off the mean there.
  for (const double b : {e.lower, e.upper}) {
    const double deviation = test::kCurveBetween * (1 + 2 * b / test::kCurveEnd);
    EXPECT_NEAR(std::fabs(3.0 - skewness_at(b)), kZ * deviation, 1e-9) << b;
  }
  EXPECT_LT(e.lower, e.backlash);
  EXPECT_GT(e.upper, e.backlash);
}

TEST(MonitoringCurve, StatusAtTheEnds) {
  const MonitoringCurve curve = linear_curve();
  const double limit = kZ * sigma(5), last = skewness_at(test::kCurveEnd);

  Estimate e = curve.invert(test::kCurveStart + 1.01 * limit, 5, 0);
  EXPECT_EQ(e.status, Status::below_range);
  EXPECT_TRUE(std::isnan(e.backlash) && std::isnan(e.lower) && std::isnan(e.upper) &&
              std::isnan(e.angle_lower));

  e = curve.invert(test::kCurveStart + 0.5 * limit, 5, 0);  // scatter explains it
  EXPECT_EQ(e.status, Status::ok);
  EXPECT_EQ(e.backlash, 0);
  EXPECT_EQ(e.lower, 0);
  EXPECT_NEAR(e.upper, backlash_at(test::kCurveStart - 0.5 * limit), 1e-12);

  e = curve.invert(last + 1.01 * limit, 5, 0);
  EXPECT_EQ(e.status, Status::ok);
  EXPECT_LT(e.upper, test::kCurveEnd);

  for (const double skewness : {last + 0.5 * limit, last, last - 0.5 * limit}) {
    e = curve.invert(skewness, 5, 0);
    EXPECT_EQ(e.status, Status::above_range) << skewness;
    EXPECT_TRUE(std::isnan(e.backlash)) << skewness;
    EXPECT_TRUE(std::isnan(e.upper)) << skewness;  // a larger backlash would explain it too
    EXPECT_NEAR(e.lower, backlash_at(skewness + limit), 1e-12) << skewness;
    EXPECT_DOUBLE_EQ(e.angle_lower, e.lower * test::kCurveToAngle);
  }
  e = curve.invert(last - 1.01 * limit, 5, 0);
  EXPECT_EQ(e.status, Status::above_range);
  EXPECT_EQ(e.lower, test::kCurveEnd);
  EXPECT_TRUE(std::isnan(e.upper));
}

TEST(MonitoringCurve, AFlatCurveIsAmbiguous) {
  const Estimate e = curve_through({3, 3, 3, 3, 3}, 0.1).invert(3.05, 1, 0);
  EXPECT_EQ(e.status, Status::ambiguous);
  EXPECT_TRUE(std::isnan(e.backlash));
  EXPECT_EQ(e.lower, 0);
  EXPECT_TRUE(std::isnan(e.upper));
  // Also off the curve: a bound would claim to know something.
  for (const double off : {3.5, 2.5}) {
    const Estimate far = curve_through({3, 3, 3, 3, 3}, 0.1).invert(off, 1, 0);
    EXPECT_EQ(far.status, Status::ambiguous);
    EXPECT_NE(far.message.find("does not depend on backlash"), std::string::npos) << far.message;
  }
  // 2 * 1.96 * 0.1 = 0.392 is what scatter hides.
  EXPECT_TRUE(curve_through({3.19, 3.1, 3, 2.9, 2.81}, 0.1).flat());
  EXPECT_FALSE(curve_through({3.2, 3.1, 3, 2.9, 2.8}, 0.1).flat());
}

TEST(MonitoringCurve, ARisingStretchIsFlaggedAndAllBranchesCovered) {
  MonitoringCurve curve = curve_through({5, 4, 3, 3.5, 3.2, 2, 1, 0, -1, -2}, 0.02);
  std::vector<bool> monotonic;
  curve.finish(straight_middle(curve));
  for (const CurvePoint& point : curve.points) monotonic.push_back(point.monotonic);
  EXPECT_EQ(monotonic, (std::vector<bool>{true, true, true, false, false, true, true, true, true, true}));

  curve = curve_through({5, 4, 3, 3.5, 3.2, 2, 1, 0, -1, -2}, 0.02);
  curve.points[3].monotonic = false;
  const Estimate e = curve.invert(3.3, 1, 0);
  ASSERT_EQ(e.status, Status::ok) << e.message;
  // Branches at 1.7 um (slope -1), 2.6 um (slope 0.5) and 3.67 um (slope -0.3); 0.0392 is 1.96 times the
  // scatter.
  EXPECT_NEAR(e.lower, (1.7 - kZ * 0.02) * 1e-6, 1e-15);
  EXPECT_NEAR(e.upper, (3 + (0.2 + kZ * 0.02) / 0.3) * 1e-6, 1e-15);
  EXPECT_NE(e.message.find("not monotonic"), std::string::npos) << e.message;
  EXPECT_EQ(curve.invert(1.5, 1, 0).message.find("not monotonic"), std::string::npos);
}

TEST(MonitoringCurve, FinishAddsTheRoughnessThatTheGridDoesNotResolve) {
  MonitoringCurve straight = linear_curve();
  straight.finish(straight_middle(straight));
  for (const CurvePoint& point : straight.points) {
    EXPECT_NEAR(point.cells[0].between, test::kCurveBetween, 1e-12);  // rounding
    EXPECT_TRUE(point.monotonic);
  }
  // A value scattered with standard deviation s lies s sqrt(1.5) from the mean of two others.
  Random random(11);
  std::vector<double> means;
  for (int i = 0; i < 2000; ++i) means.push_back(-0.001 * i + 0.05 * random.normal());
  MonitoringCurve rough = curve_through(means, 0);
  std::vector<std::vector<SkewnessCell>> middle = straight_middle(rough);
  for (std::size_t i = 0; i < middle.size(); ++i)
    for (SkewnessCell& cell : middle[i])
      cell.mean = -0.001 * (static_cast<double>(i) + 0.5) + 0.05 * random.normal();
  rough.finish(middle);
  double squares = 0;
  for (const CurvePoint& point : rough.points) squares += point.cells[1].between * point.cells[1].between;
  EXPECT_NEAR(std::sqrt(squares / means.size()), 0.05, 0.005);  // 2000 values: 2 %, five times that
}

TEST(MonitoringCurve, FinishSharesTheScatterOfNeighbours) {
  MonitoringCurve curve = linear_curve();
  auto middle = straight_middle(curve);
  for (auto& cells : middle) cells[0].between = 3 * test::kCurveBetween;
  curve.finish(middle);
  // Mean of the squares of 1 and 3 (one neighbour) or of 1, 3 and 3 (two).
  EXPECT_NEAR(curve.points[0].cells[0].between, std::sqrt(5.0) * test::kCurveBetween, 1e-12);
  EXPECT_NEAR(curve.points[5].cells[0].between, std::sqrt(19 / 3.0) * test::kCurveBetween, 1e-12);
  EXPECT_NEAR(curve.points[5].cells[1].between, test::kCurveBetween, 1e-12);
}

TEST(MonitoringCurve, NoiseIsInterpolatedAndHeldOutsideItsLevels) {
  MonitoringCurve curve = linear_curve(3);
  for (CurvePoint& point : curve.points) point.cells[1] = {point.cells[0].mean - 1, 0.25, 0.3};
  EXPECT_NEAR(curve.at(1e-4, 0).mean, skewness_at(1e-4), 1e-12);
  EXPECT_NEAR(curve.at(0.5e-4, 0.0025).mean, skewness_at(0.5e-4) - 0.25, 1e-12);
  EXPECT_NEAR(curve.at(0.5e-4, 0.0025).between, 0.05 + 0.25 * 0.2, 1e-12);
  EXPECT_NEAR(curve.at(0.5e-4, 0.0025).within, 0.1 + 0.25 * 0.2, 1e-12);
  EXPECT_EQ(curve.at(1e-4, 5).mean, curve.at(1e-4, 0.01).mean);
  EXPECT_EQ(curve.at(5, 0).mean, curve.at(test::kCurveEnd, 0).mean);
  EXPECT_EQ(curve.at(-5, -5).mean, curve.at(0, 0).mean);
  EXPECT_NEAR(curve.invert(2.5, 3, 0.01).backlash, backlash_at(3.5), 1e-12);
  curve.conditions.noise = 0.01;
  EXPECT_EQ(curve.nominal(curve.points[1]).between, 0.25);
}

TEST(MonitoringCurve, AnUnknownNoiseWidensTheInterval) {
  MonitoringCurve curve = linear_curve();
  for (CurvePoint& point : curve.points) point.cells[1].mean -= 0.5;  // at a noise of 0.01
  const double half = kZ * sigma(5) / -test::kCurveSlope;
  const Estimate e = curve.invert(3, 5, {0.002, 0.006});
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_NEAR(e.backlash, backlash_at(3.3), 1e-12);  // at the upper end
  EXPECT_NEAR(e.lower, backlash_at(3.3) - half, 1e-12);
  EXPECT_NEAR(e.upper, backlash_at(3.1) + half, 1e-12);
  EXPECT_NEAR(curve.invert(3, 5, {0.006, 0.006}).upper, backlash_at(3.3) + half, 1e-12);
  const Estimate any = curve.invert(3, 5, signal::NoiseRange());
  EXPECT_NEAR(any.lower, backlash_at(3.5) - half, 1e-12);
  EXPECT_NEAR(any.upper, backlash_at(3.0) + half, 1e-12);
  EXPECT_EQ(curve.invert(3, 5, {-1, 99}).upper, any.upper);
  // Only noise explains so little skewness.
  EXPECT_EQ(curve.invert(1.2, 5, {0, 0}).status, Status::above_range);
  EXPECT_EQ(curve.invert(1.2, 5, {0.01, 0.01}).status, Status::ok);
  const Estimate either = curve.invert(1.2, 5, {0, 0.01});
  EXPECT_EQ(either.status, Status::above_range);
  EXPECT_NEAR(either.lower, backlash_at(1.7) - half, 1e-12);
  EXPECT_EQ(curve.invert(5, 5, {0, 0.01}).status, Status::below_range);
  EXPECT_EQ(curve.invert(0.5, 5, {0, 0.01}).status, Status::above_range);
}

TEST(MonitoringCurve, AnAngularCurveGivesAnglesOnly) {
  MonitoringCurve curve = linear_curve();
  curve.conditions.angular = true;
  curve.backlash_to_angle = 100;
  const Estimate e = curve.invert(3, 5, 0);
  EXPECT_TRUE(std::isnan(e.backlash) && std::isnan(e.lower) && std::isnan(e.upper));
  EXPECT_NEAR(e.backlash_angle, 100 * backlash_at(3), 1e-10);
  EXPECT_EQ(curve.invert(-9, 5, 0).angle_lower, 100 * test::kCurveEnd);
}

/// Share of `trials` of the statistical model itself in which the answer holds the truth.
double coverage(const MonitoringCurve& curve, int periods, int trials, unsigned seed) {
  Random random(seed);
  int covered = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const double b = random.uniform(curve.points.front().backlash, curve.points.back().backlash);
    const SkewnessCell cell = curve.at(b, 0);
    double skewness = cell.mean + cell.between * random.normal();
    for (int i = 0; i < periods; ++i) skewness += cell.within * random.normal() / periods;
    const Estimate e = curve.invert(skewness, periods, 0);
    covered += e.lower <= b && (e.status == Status::ok ? b <= e.upper : !(b > e.upper));
  }
  return static_cast<double>(covered) / trials;
}

TEST(MonitoringCurve, IntervalsHoldTheTruthInNinetyFivePercent) {
  const int trials = 4000;
  const double bound = 5 * std::sqrt(0.95 * 0.05 / trials);  // five binomial standard deviations
  MonitoringCurve curved = linear_curve();
  for (std::size_t i = 0; i < curved.points.size(); ++i)
    for (SkewnessCell& cell : curved.points[i].cells)
      cell = {1.5 + 3 * std::exp(-0.12 * i), 0.02 + 0.004 * i, 0.2 - 0.005 * i};
  for (const int periods : {1, 5, 18}) {
    EXPECT_NEAR(coverage(linear_curve(), periods, trials, 1), 0.95, bound) << periods;
    EXPECT_NEAR(coverage(curved, periods, trials, 2), 0.95, bound) << periods;
  }
  // With several branches the interval spans what lies between them too: it may hold the truth more often.
  MonitoringCurve rising = linear_curve();
  for (SkewnessCell& cell : rising.points[8].cells) cell.mean += 0.4;
  EXPECT_GT(coverage(rising, 5, trials, 3), 0.95 - bound);
}

void expect_same(const MonitoringCurve& a, const MonitoringCurve& b) {
  const CurveConditions &x = a.conditions, &y = b.conditions;
  for (const auto member : {&CurveConditions::rig, &CurveConditions::rig_digest, &CurveConditions::version,
                            &CurveConditions::signal, &CurveConditions::excitation})
    EXPECT_EQ(x.*member, y.*member);
  for (const auto member :
       {&CurveConditions::amplitude, &CurveConditions::excitation_level, &CurveConditions::frequency,
        &CurveConditions::sampling_rate, &CurveConditions::noise, &CurveConditions::motor_travel})
    EXPECT_EQ(x.*member, y.*member);
  for (const auto member :
       {&CurveConditions::periods, &CurveConditions::settling_periods, &CurveConditions::seeds})
    EXPECT_EQ(x.*member, y.*member);
  EXPECT_TRUE(x.apd == y.apd);
  EXPECT_EQ(x.output_locked, y.output_locked);
  EXPECT_EQ(x.angular, y.angular);
  EXPECT_EQ(a.noise_levels, b.noise_levels);
  EXPECT_EQ(a.backlash_to_angle, b.backlash_to_angle);
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].backlash, b.points[i].backlash);
    EXPECT_EQ(a.points[i].signal_level, b.points[i].signal_level);
    EXPECT_EQ(a.points[i].monotonic, b.points[i].monotonic);
    ASSERT_EQ(a.points[i].cells.size(), b.points[i].cells.size());
    for (std::size_t k = 0; k < a.points[i].cells.size(); ++k) {
      EXPECT_EQ(a.points[i].cells[k].mean, b.points[i].cells[k].mean);
      EXPECT_EQ(a.points[i].cells[k].between, b.points[i].cells[k].between);
      EXPECT_EQ(a.points[i].cells[k].within, b.points[i].cells[k].within);
    }
  }
}

MonitoringCurve parse(const std::string& text) {
  return MonitoringCurve::from_yaml(YamlReader::from_text(text, "curve.yaml"));
}

TEST(MonitoringCurve, FilesKeepEveryBit) {
  Random random(5);
  MonitoringCurve curve = linear_curve(30);
  CurveConditions& c = curve.conditions;
  c.rig = "a \"quoted\" rig: # é [x]\n'second line' \\";
  c.excitation = "true";
  c.version = "1.0";
  c.rig_digest = "0123456789012345";
  c.periods = 100000;  // whole numbers stay whole whatever their size
  c.settling_periods = 1000000;
  c.seeds = 1000000;
  c.angular = true;
  c.output_locked = false;
  for (double* value : {&c.amplitude, &c.excitation_level, &c.frequency, &c.sampling_rate, &c.motor_travel})
    *value = random.uniform();
  c.apd = {77, -random.uniform(), random.uniform()};
  curve.noise_levels = {0, 1e-300, random.uniform() / 3, 1e9};
  c.noise = curve.noise_levels[2];
  for (CurvePoint& point : curve.points) {
    point.monotonic = random.uniform() < 0.5;
    point.cells.clear();
    for (int k = 0; k < 4; ++k)
      point.cells.push_back({random.uniform() - 0.5, random.uniform(), random.uniform() * 1e-9});
  }
  const std::string text = curve.to_yaml();
  expect_same(curve, parse(text));
  EXPECT_EQ(parse(text).to_yaml(), text);

  const std::string path =
      (std::filesystem::temp_directory_path() / ("curve_" + std::to_string(::getpid()) + ".yaml")).string();
  write_curve(curve, path);
  expect_same(curve, read_curve(path));
  std::remove(path.c_str());
  EXPECT_THROW(read_curve(path), MissingInput);
  EXPECT_THROW(write_curve(curve, "/nonexistent/folder/curve.yaml"), CannotWrite);
}

TEST(MonitoringCurve, MalformedFilesAreRefusedWithTheirKey) {
  const std::string good = linear_curve(3).to_yaml();
  ASSERT_NO_THROW(parse(good));
  struct Case {
    const char *from, *to, *key;
  };
  const std::vector<Case> cases = {
      {"schema_version: 2", "schema_version: 1", "schema_version"},
      {"schema_version: 2", "schema_version: 1", "build_curve draws it anew"},
      {"schema_version: 2\n", "", "schema_version"},
      {"  rig: \"linear\"\n", "", "conditions.rig"},
      {"\"sensor_torque\"", "\"torque\"", "conditions.signal"},
      {"amplitude: 0.05", "amplitude: -1", "conditions.amplitude"},
      {"frequency: 10", "frequency: ten", "conditions.frequency"},
      {"sampling_rate: 1000", "sampling_rate: 0", "conditions.sampling_rate"},
      {"classes: 60", "classes: 1", "conditions.apd.classes"},
      {"upper: 0.4", "upper: -0.4", "conditions.apd.upper"},
      {"periods: 10 ", "periods: 0 ", "conditions.periods"},
      {"settling_periods: 2", "settling_periods: 2.5", "conditions.settling_periods"},
      {"seeds: 8", "seeds: .nan", "conditions.seeds"},
      {"noise: 0 ", "noise: 0.005 ", "conditions.noise"},  // not among the levels
      {"motor_travel: 0.02", "motor_travel: -0.02", "conditions.motor_travel"},
      {"output_locked: true", "output_locked: yes", "conditions.output_locked"},
      {"angular: false", "angular: 0", "conditions.angular"},
      {"angular: false", "angular: false\n  colour: red", "conditions.colour"},
      {"backlash_to_angle: 67", "backlash_to_angle: 0", "backlash_to_angle"},
      {"noise_levels: [0, 0.01]", "noise_levels: []", "noise_levels"},
      {"noise_levels: [0, 0.01]", "noise_levels: [0, 0]", "noise_levels"},
      {"noise_levels: [0, 0.01]", "noise_levels: [0]", "mean"},
      {"noise_levels: [0, 0.01]", "noise_levels: 0", "noise_levels"},
      {"backlash: 0\n", "backlash: -1e-6\n", "points[0].backlash"},
      {"backlash: 0\n", "backlash: 1\n", "points"},  // must increase
      {"monotonic: true", "monotonic: maybe", "points[0].monotonic"},
      {"mean: [4.5, 4.5]", "mean: [4.5, .nan]", "points[0].mean"},
      {"mean: [4.5, 4.5]", "mean: [4.5]", "points[0].mean"},
      {"between: [0.05, 0.05]", "between: [0.05, -0.05]", "points[0].between"},
      {"within: [0.1, 0.1]", "spread: [0.1, 0.1]", "points[0].within"},
      {"points:\n", "dots:\n", "points"},
      // Repeated for readers, who may think that it counts.
      {"half_gap: 0\n", "half_gap: 1e-5\n", "points[0].half_gap"},
      {"scatter: ", "scatter: m ", "points[0].scatter"},
  };
  for (const Case& c : cases) {
    std::string text = good;
    const auto at = text.find(c.from);
    ASSERT_NE(at, std::string::npos) << c.from;
    text.replace(at, std::string(c.from).size(), c.to);
    try {
      parse(text);
      ADD_FAILURE() << c.to << " was accepted";
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(c.key), std::string::npos) << c.to << ": " << error.what();
    }
  }
  EXPECT_THROW(parse("{}"), BadData);
  EXPECT_THROW(parse(""), BadData);
  EXPECT_THROW(parse(linear_curve(1 + 1).to_yaml().substr(0, 700)), BadData);
  MonitoringCurve single = linear_curve(2);
  single.points.pop_back();
  EXPECT_THROW(parse(single.to_yaml()), BadData);
}

}  // namespace
}  // namespace backlash::diagnosis
