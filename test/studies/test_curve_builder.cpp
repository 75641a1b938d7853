// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/studies/curve_builder.h"
#include "support/data.h"

namespace backlash::studies {
namespace {

/// A quick one: 5 periods of the built-in rig.
CurveRequest quick(int points = 3) {
  CurveRequest request;
  request.points = points;
  request.periods = 2;
  request.seeds = 3;
  request.machines = 0;
  return request;
}

TEST(BuildCurve, MeetsThePublishedParametersOfTheSarkarRig) {
  CurveRequest request;
  request.points = 5;  // half gaps 0, 25, 50, 75 and 100 um
  request.sampling_rate = 10000;
  request.periods = 1;
  request.machines = 0;
  const diagnosis::MonitoringCurve curve =
      build_curve(rig_file::load_rig_file(test::package_file("config/sarkar_1997.yaml")), request);
  ASSERT_EQ(curve.points.size(), 5u);
  // By a separate program with the same parameters; rounded, and from one sampling phase. Beyond 60 um the
  // motion is not periodic and the value scatters.
  const double expected[] = {4.57, 3.60, 2.86};
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(curve.nominal(curve.points[i]).mean, expected[i], 0.1) << i;
  EXPECT_GT(curve.nominal(curve.points[3]).mean, 1.8);
  EXPECT_LT(curve.nominal(curve.points[3]).mean, 2.3);
  EXPECT_GT(curve.nominal(curve.points[4]).mean, 1.5);
  EXPECT_LT(curve.nominal(curve.points[4]).mean, 2.0);
}

TEST(BuildCurve, KnowsItsConditions) {
  rig_file::RigFile file = rig_file::default_rig_file();
  file.simulation.sensors.of(record::Channel::sensor_torque).noise = 0.0007;
  const diagnosis::MonitoringCurve curve = build_curve(file, quick());
  const diagnosis::CurveConditions& c = curve.conditions;
  EXPECT_EQ(c.rig, "sarkar_1997");
  EXPECT_EQ(c.rig_digest, file.digest);
  EXPECT_FALSE(c.version.empty());
  EXPECT_EQ(c.signal, "sensor_torque");
  EXPECT_EQ(c.excitation, "square");
  EXPECT_EQ(c.amplitude, 0.05);
  EXPECT_EQ(c.excitation_level, 0.05);
  EXPECT_DOUBLE_EQ(c.frequency, 10);
  EXPECT_EQ(c.sampling_rate, 1000);
  EXPECT_TRUE(c.apd == file.diagnosis.apd->layout);
  EXPECT_EQ(c.periods, 2);
  EXPECT_EQ(c.settling_periods, 2);
  EXPECT_EQ(c.seeds, 3);
  EXPECT_EQ(c.noise, 0.0007);
  EXPECT_TRUE(c.output_locked);
  EXPECT_FALSE(c.angular);
  EXPECT_DOUBLE_EQ(curve.backlash_to_angle, 1 / 0.014917);
  EXPECT_EQ(curve.points[0].backlash, 0);
  EXPECT_DOUBLE_EQ(curve.points[1].backlash, 1e-4);
  EXPECT_DOUBLE_EQ(curve.points[2].backlash, 2e-4);
  // The play at the largest gap and the wind-up of the sensor on both sides; ringing adds to it.
  EXPECT_GT(c.motor_travel, 2e-4 / 0.014917 + 2 * 0.05 / 28.71);
  EXPECT_LT(c.motor_travel, 1.3 * (2e-4 / 0.014917 + 2 * 0.05 / 28.71));
  EXPECT_TRUE(std::is_sorted(curve.noise_levels.begin(), curve.noise_levels.end()));
  EXPECT_EQ(std::count(curve.noise_levels.begin(), curve.noise_levels.end(), 0.0007), 1);
  EXPECT_EQ(curve.noise_levels.front(), 0);
  EXPECT_DOUBLE_EQ(curve.noise_levels.back(), 0.3 * 0.05);
  for (const diagnosis::CurvePoint& point : curve.points) {
    EXPECT_EQ(point.cells.size(), curve.noise_levels.size());
    EXPECT_NEAR(point.signal_level, 0.05, 0.005);  // the sensor settles at the torque; ringing is about that
    // More noise, a wider APD, less skewness.
    EXPECT_LT(point.cells.back().mean, point.cells.front().mean);
  }
}

TEST(BuildCurve, NoiseLevelsOfAMultiSineFollowItsLargestTorque) {
  rig_file::RigFile file = rig_file::default_rig_file();
  file.simulation.excitation.type = "multi_sine";
  file.simulation.excitation.amplitude = 0;
  file.simulation.excitation.lines = {{0.03, 10, 0}, {0.01, 30, 1}};
  EXPECT_DOUBLE_EQ(build_curve(file, quick(2)).noise_levels.back(), 0.3 * 0.04);
}

TEST(BuildCurve, IsReadBackAsWritten) {
  const diagnosis::MonitoringCurve curve = build_curve(rig_file::default_rig_file(), quick());
  const std::string text = curve.to_yaml();
  EXPECT_EQ(diagnosis::MonitoringCurve::from_yaml(YamlReader::from_text(text, "curve")).to_yaml(), text);
}

TEST(BuildCurve, WhatTheFileLeavesOpenIsReadBackAndLeavesTheCurveAsItIs) {
  CurveRequest request = quick();
  const std::string known = build_curve(rig_file::default_rig_file(), request).to_yaml();
  request.machines = 4;
  diagnosis::MonitoringCurve curve = build_curve(rig_file::default_rig_file(), request);
  ASSERT_TRUE(curve.spread);
  EXPECT_EQ(curve.spread->machines, 4);
  EXPECT_FALSE(curve.spread->limit.empty());
  const std::string text = curve.to_yaml();
  EXPECT_EQ(diagnosis::MonitoringCurve::from_yaml(YamlReader::from_text(text, "curve")).to_yaml(), text);
  curve.spread.reset();
  EXPECT_EQ(curve.to_yaml(), known);
}

TEST(BuildCurve, IsDeterministicOnAnyNumberOfProcessors) {
  const rig_file::RigFile file = rig_file::default_rig_file();
  const std::string all = build_curve(file, quick(4)).to_yaml();
  EXPECT_EQ(build_curve(file, quick(4)).to_yaml(), all);
  cpu_set_t allowed, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  CPU_ZERO(&one);
  for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu)
    if (CPU_ISSET(cpu, &allowed)) CPU_SET(cpu, &one);
  if (sched_setaffinity(0, sizeof one, &one) == 0) {
    EXPECT_EQ(build_curve(file, quick(4)).to_yaml(), all);
    sched_setaffinity(0, sizeof allowed, &allowed);
  }
}

// The mean at a point does not depend on its neighbours or on the order in which the points are worked on
// (its scatter does: neighbours share theirs). Points that are moved at once share their steps, so that their
// runs differ by errors of the solver; where a gap is chaotic these decide which of many like motions is run,
// and so the mean within its own scatter.
TEST(BuildCurve, PointsDependOnTheOthersByTheSolversErrorOnly) {
  const diagnosis::MonitoringCurve three = build_curve(rig_file::default_rig_file(), quick(3)),
                                   two = build_curve(rig_file::default_rig_file(), quick(2));
  for (const auto& [i, k] : {std::pair{0, 0}, std::pair{2, 1}})
    for (std::size_t level = 0; level < three.noise_levels.size(); ++level)
      EXPECT_NEAR(three.points[i].cells[level].mean, two.points[k].cells[level].mean,
                  std::hypot(two.points[k].cells[level].within, two.points[k].cells[level].between));
}

TEST(BuildCurve, MoreSeedsKeepTheFirstAndChangeTheRest) {
  CurveRequest request = quick(2);
  request.seeds = 1;
  const double one = build_curve(rig_file::default_rig_file(), request).points[0].cells.back().mean;
  rig_file::RigFile file = rig_file::default_rig_file();
  file.simulation.sensors.seed = 99;
  EXPECT_NE(build_curve(file, request).points[0].cells.back().mean, one);
}

TEST(BuildCurve, ProgressRisesToOneAndIsNeverCalledTwiceAtOnce) {
  std::atomic<int> inside{0};
  double last = 0;
  int calls = 0;
  bool overlapped = false, fell = false;
  build_curve(rig_file::default_rig_file(), quick(4), [&](double fraction, const std::string& phase) {
    overlapped |= ++inside > 1;
    fell |= fraction < last || fraction > 1 || phase.empty();
    last = fraction;
    ++calls;
    --inside;
    return true;
  });
  EXPECT_FALSE(overlapped);
  EXPECT_FALSE(fell);
  EXPECT_EQ(last, 1);
  EXPECT_GT(calls, 4);  // also while a point is being worked on
}

TEST(BuildCurve, StopsWhenProgressSaysSo) {
  CurveRequest request;  // would take minutes
  request.points = 100;
  request.periods = 1000;
  for (const int calls_before : {0, 2}) {
    int calls = 0;
    EXPECT_THROW(build_curve(rig_file::default_rig_file(), request,
                             [&](double fraction, const std::string&) {
                               EXPECT_LT(fraction, 0.05);
                               return calls++ < calls_before;
                             }),
                 Cancelled);
    EXPECT_EQ(calls, calls_before + 1);  // not asked again
  }
}

TEST(BuildCurve, RefusesWhatItCannotBuild) {
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::nan("");
  struct Case {
    std::function<void(rig_file::RigFile&, CurveRequest&)> change;
    std::string name;
  };
  std::vector<Case> cases = {
      {[](rig_file::RigFile&, CurveRequest& r) { r.points = 1; }, "points"},
      {[](rig_file::RigFile&, CurveRequest& r) { r.points = -5; }, "points"},
      {[](rig_file::RigFile&, CurveRequest& r) { r.periods = 0; }, "periods"},
      {[](rig_file::RigFile&, CurveRequest& r) { r.periods = 2000000000; }, "periods"},
      {[](rig_file::RigFile&, CurveRequest& r) { r.seeds = 0; }, "seeds"},
      {[](rig_file::RigFile&, CurveRequest& r) { r.sampling_rate = 1e12; }, "periods"},  // too many samples
      {[](rig_file::RigFile&, CurveRequest& r) { r.sampling_rate = 50; }, "sample_rate"},
      {[](rig_file::RigFile&, CurveRequest& r) { r.sampling_rate = 1e-300; }, "sample_rate"},
      {[](rig_file::RigFile& f, CurveRequest&) { f.diagnosis.apd.reset(); }, "diagnosis.apd"},
      {[](rig_file::RigFile& f, CurveRequest&) { f.simulation.excitation.type = "constant"; },
       "excitation.type"},
      {[](rig_file::RigFile& f, CurveRequest&) { f.simulation.excitation.type = "topic"; },
       "excitation.type"},
      {[](rig_file::RigFile& f, CurveRequest&) { f.simulation.excitation.type = "saw"; }, "excitation.type"},
      {[](rig_file::RigFile& f, CurveRequest&) { f.rig.input_coupling = model::Coupling(); },
       "diagnosis.apd.signal"},
      {[](rig_file::RigFile& f, CurveRequest&) { f.diagnosis.apd->layout.classes = 1; }, "apd.classes"},
      {[](rig_file::RigFile& f, CurveRequest&) {
         f.diagnosis.apd->layout = {60, 5, 6};
       },
       "diagnosis.apd"},  // never reached
  };
  for (const double value : {0.0, -1e-4, nan, infinity})
    cases.push_back(
        {[value](rig_file::RigFile&, CurveRequest& r) { r.max_backlash = value; }, "max_backlash"});
  for (const double value : {-1.0, nan, infinity})
    cases.push_back(
        {[value](rig_file::RigFile&, CurveRequest& r) { r.sampling_rate = value; }, "sample_rate"});
  for (const Case& c : cases) {
    rig_file::RigFile file = rig_file::default_rig_file();
    CurveRequest request = quick(2);
    c.change(file, request);
    try {
      build_curve(file, request);
      ADD_FAILURE() << c.name << " was accepted";
    } catch (const InvalidParameter& error) {
      EXPECT_EQ(error.name(), c.name) << error.what();
    }
  }
}

TEST(CheckCurve, AnotherVersionIsReportedAnotherGeometryIsRefused) {
  const rig_file::RigFile file = rig_file::default_rig_file();
  diagnosis::MonitoringCurve curve;
  curve.backlash_to_angle = 1 / 0.014917;  // the base radius of the default rig
  curve.conditions.rig_digest = file.digest;
  EXPECT_EQ(check_curve(curve, file, "curve.yaml"), "");
  curve.conditions.rig_digest = "another";
  EXPECT_NE(check_curve(curve, file, "curve.yaml"), "");
  curve.backlash_to_angle *= 1000;
  try {
    check_curve(curve, file, "curve.yaml");
    ADD_FAILURE() << "a base radius in millimetres was accepted";
  } catch (const BadData& error) {
    EXPECT_NE(std::string(error.what()).find("curve.yaml"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("backlash_to_angle"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace backlash::studies
