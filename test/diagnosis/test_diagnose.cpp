// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "support/curve.h"
#include "support/estimates.h"
#include "support/records.h"

namespace backlash::diagnosis {
namespace {

using test::by;
using test::linear_curve;
using test::make_record;

DiagnosisSettings all_settings() {
  DiagnosisSettings settings;
  settings.apd = ApdSettings{record::Channel::sensor_torque, 0.1, 2, {60, -0.4, 0.4}};
  LostMotionSettings lost_motion;
  lost_motion.torque = 0.05;
  lost_motion.base_radius = 0.015;
  settings.lost_motion = lost_motion;
  settings.limits = Limits{false, 1e-4, 1.5e-4, 2e-4};
  return settings;
}

TEST(Diagnose, AllMethodsInTheirOrder) {
  const MonitoringCurve curve = linear_curve();
  const Diagnosis d = diagnose(make_record({}), all_settings(), &curve);
  ASSERT_EQ(d.estimates.size(), diagnosis_methods().size());
  for (std::size_t i = 0; i < d.estimates.size(); ++i)
    EXPECT_EQ(d.estimates[i].method, diagnosis_methods()[i]);
  for (const char* method : {"apd_skewness", "lost_motion"})
    EXPECT_EQ(by(method, d.estimates).status, Status::ok) << by(method, d.estimates).message;
  ASSERT_TRUE(d.apd);
  EXPECT_EQ(d.apd->periods.size(), 13u);
  // The curve is not that of this machine: 0.01 rad times 0.015 m, which the walls show, is not on it.
  EXPECT_EQ(d.verdict.estimate, -1) << d.verdict.message;
  EXPECT_EQ(d.verdict.grade, Grade::cannot_tell);
  // 2 %: the ringing of 20 % has died out by exp(-5) where the wall is read.
  EXPECT_NEAR(by("lost_motion", d.estimates).backlash, 1.5e-4, 3e-6);
}

TEST(Diagnose, TheVerdictUsesLimitsAndBaseline) {
  DiagnosisSettings settings = all_settings();
  settings.limits = Limits{false, 1e-5, 2e-5, 1e-4};
  EXPECT_EQ(diagnose(make_record({}), settings, nullptr).verdict.grade, Grade::stop);
  Baseline baseline;
  baseline.backlash = 1.35e-4;
  const Verdict v = diagnose(make_record({}), settings, nullptr, baseline).verdict;
  EXPECT_EQ(v.grade, Grade::watch);
  EXPECT_NEAR(v.growth, 0.15e-4, 3e-6);  // as above
}

/// A square wave of 0.05 N m that swings a joint by a radian, though the file says that it is locked.
TEST(Diagnose, ALockThatMovesIsReportedNotMeasured) {
  DiagnosisSettings settings = all_settings();
  settings.position_difference.emplace();
  settings.position_difference->elastic_deflection = [](double torque) { return torque / 30; };
  settings.position_difference->base_radius = 0.015;
  settings.position_difference->output_locked = true;
  settings.momentum_transfer.emplace();
  settings.momentum_transfer->motor_inertia = 1e-5;
  settings.momentum_transfer->output_locked = true;
  record::Record record = make_record({});
  EXPECT_EQ(by("lost_motion", diagnose(record, settings, nullptr).estimates).status, Status::ok);
  for (double& q : record.column(record::Channel::motor_position)) q *= 100;
  const Diagnosis d = diagnose(record, settings, nullptr);
  for (const char* method : {"lost_motion", "momentum_transfer"}) {
    EXPECT_EQ(by(method, d.estimates).status, Status::out_of_domain);
    EXPECT_NE(by(method, d.estimates).message.find("locked"), std::string::npos);
  }
  EXPECT_EQ(d.verdict.grade, Grade::cannot_tell) << d.verdict.message;
}

TEST(Diagnose, OneMethod) {
  const MonitoringCurve curve = linear_curve();
  for (const std::string& method : diagnosis_methods()) {
    const Diagnosis d = diagnose(make_record({}), all_settings(), &curve, std::nullopt, method);
    ASSERT_EQ(d.estimates.size(), 1u);
    EXPECT_EQ(d.estimates[0].method, method);
    const bool sound = d.estimates[0].status == Status::ok;  // a linear curve has no family of distributions
    EXPECT_EQ(d.verdict.estimate, sound ? 0 : -1);
    EXPECT_EQ(d.verdict.agreement, sound ? "single" : "none");
  }
  for (const char* method : {"apd", "Lost_motion", "apd_skewness ", "all"}) try {
      diagnose(make_record({}), all_settings(), &curve, std::nullopt, method);
      ADD_FAILURE() << method;
    } catch (const InvalidParameter& error) {
      EXPECT_NE(std::string(error.what()).find(joined(diagnosis_methods())), std::string::npos)
          << error.what();
    }
}

TEST(Diagnose, WhatCannotBeServedIsListedWithItsReason) {
  DiagnosisSettings settings = all_settings();
  Diagnosis d = diagnose(make_record({}), settings, nullptr);
  EXPECT_EQ(d.estimates[0].status, Status::insufficient_data);
  EXPECT_NE(d.estimates[0].message.find("curve"), std::string::npos);
  EXPECT_FALSE(std::isnan(d.estimates[0].skewness));  // of use as a baseline
  settings.apd.reset();
  settings.lost_motion.reset();
  d = diagnose(make_record({}), settings, nullptr);
  ASSERT_EQ(d.estimates.size(), diagnosis_methods().size());
  for (const Estimate& e : d.estimates) {
    EXPECT_EQ(e.status, Status::insufficient_data);
    const bool of_the_file = e.method.find("apd") == 0 || e.method == "lost_motion";
    EXPECT_NE(e.message.find(of_the_file ? "declares no diagnosis." : "the rig"), std::string::npos)
        << e.message;
  }
  EXPECT_EQ(d.verdict.grade, Grade::cannot_tell);
  EXPECT_FALSE(d.apd);
}

TEST(Diagnose, RecordsTooShortForAWholeSettledPeriod) {
  const MonitoringCurve curve = linear_curve();
  for (const double duration : {0.0, 0.0005, 0.05, 0.15, 0.299}) {
    const Diagnosis d = diagnose(make_record({}).slice(0, duration), all_settings(), &curve);
    ASSERT_EQ(d.estimates.size(), diagnosis_methods().size());
    for (const Estimate& e : d.estimates) {
      EXPECT_EQ(e.status, Status::insufficient_data) << duration << ' ' << e.message;
      EXPECT_NE(e.message.find("whole excitation period"), std::string::npos) << e.message;
    }
    EXPECT_EQ(d.verdict.grade, Grade::cannot_tell);
  }
  EXPECT_EQ(diagnose(make_record({}).slice(0, 0.3), all_settings(), &curve).estimates[0].status, Status::ok);
}

TEST(Diagnose, SettlingIsDiscardedForAllMethods) {
  const MonitoringCurve curve = linear_curve();
  record::Record record = make_record({});
  for (std::size_t i = 0; i < 200; ++i) {  // the first two periods are nonsense
    record.column(record::Channel::sensor_torque)[i] = 0.3;
    record.column(record::Channel::motor_position)[i] = 9;
  }
  const Diagnosis spoilt = diagnose(record, all_settings(), &curve),
                  clean = diagnose(make_record({}), all_settings(), &curve);
  for (const char* method : {"apd_skewness", "lost_motion"}) {
    EXPECT_EQ(by(method, spoilt.estimates).backlash, by(method, clean.estimates).backlash);
    EXPECT_EQ(by(method, spoilt.estimates).upper, by(method, clean.estimates).upper);
  }
}

TEST(DiagnosisSettings, ReadFromARigFile) {
  const auto read = [](const std::string& text) {
    const YamlReader yaml = YamlReader::from_text(text, "rig.yaml");
    const DiagnosisSettings settings = read_diagnosis_settings(yaml);
    yaml.finish();
    return settings;
  };
  const DiagnosisSettings all = read(
      "apd: {signal: motor_velocity, period: 0.2, settling_periods: 3, classes: 40, lower: -1, upper: 2}\n"
      "lost_motion: {torque: 3.5, elastic_deflection: included}\n"
      "limits: {backlash_angle: {watch: 1, service: 2, stop: 3}}\n");
  ASSERT_TRUE(all.apd && all.lost_motion && all.limits);
  EXPECT_EQ(all.apd->signal, record::Channel::motor_velocity);
  EXPECT_EQ(all.apd->period, 0.2);
  EXPECT_EQ(all.apd->settling_periods, 3);
  EXPECT_TRUE(all.apd->layout == (ApdLayout{40, -1, 2}));
  EXPECT_EQ(all.lost_motion->torque, 3.5);
  EXPECT_FALSE(all.lost_motion->subtract_elastic_deflection);
  EXPECT_TRUE(all.limits->angular);
  const DiagnosisSettings few =
      read("apd: {signal: sensor_torque, settling_periods: 0, classes: 2, lower: 0, upper: 1}");
  EXPECT_EQ(few.apd->period, 0);
  EXPECT_FALSE(few.lost_motion || few.limits);

  const std::vector<std::pair<std::string, std::string>> cases = {
      {"apd: {signal: torque, settling_periods: 0, classes: 2, lower: 0, upper: 1}", "apd.signal"},
      {"apd: {signal: sensor_torque, classes: 2, lower: 0, upper: 1}", "apd.settling_periods"},
      {"apd: {signal: sensor_torque, settling_periods: -1, classes: 2, lower: 0, upper: 1}",
       "apd.settling_periods"},
      {"apd: {signal: sensor_torque, period: 0, settling_periods: 1, classes: 2, lower: 0, upper: 1}",
       "apd.period"},
      {"apd: {signal: sensor_torque, settling_periods: 0, classes: 2, lower: 0, upper: 1, bins: 3}",
       "apd.bins"},
      {"lost_motion: {torque: 0, elastic_deflection: included}", "lost_motion.torque"},
      {"lost_motion: {torque: 1, elastic_deflection: both}", "lost_motion.elastic_deflection"},
      {"lost_motion: {torque: 1}", "lost_motion.elastic_deflection"},
      {"limits: {}", "limits.backlash"},
      {"alarms: {}", "alarms"}};
  for (const auto& [text, key] : cases) try {
      read(text);
      ADD_FAILURE() << text << " was accepted";
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace backlash::diagnosis
