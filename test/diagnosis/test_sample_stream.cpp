// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/diagnosis/sample_stream.h"
#include "support/curve.h"
#include "support/records.h"

namespace backlash::diagnosis {
namespace {

using test::make_record;
using test::RecordRecipe;
using test::values_at;

const ApdLayout kLayout = {60, -0.4, 0.4};

ApdSettings apd_settings(double period = 0.1, int settling = 2) {
  return {record::Channel::sensor_torque, period, settling, kLayout};
}

DiagnosisSettings diagnosis_settings(const ApdSettings& apd) {
  DiagnosisSettings settings;
  settings.apd = apd;
  LostMotionSettings lost_motion;
  lost_motion.torque = 0.05;
  lost_motion.base_radius = 0.015;
  settings.lost_motion = lost_motion;
  settings.limits = Limits{false, 1e-4, 1.5e-4, 2e-4};
  return settings;
}

/// What a stream says about a whole record.
struct Live {
  explicit Live(const StreamSettings& settings) : stream(settings) {}
  SampleStream stream;
  std::vector<PeriodResult> periods;

  void push(const record::Record& record) {
    for (std::size_t i = 0; i < record.size(); ++i)
      if (const PeriodResult* period = stream.add(record.time[i], values_at(record, i)))
        periods.push_back(*period);
  }
};

bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

void expect_same(const record::Record& a, const record::Record& b) {
  EXPECT_EQ(a.time, b.time);
  for (const record::Channel channel : record::kChannels)
    EXPECT_EQ(a.column(channel), b.column(channel)) << record::channel_name(channel);
}

void expect_same(const Diagnosis& a, const Diagnosis& b) {
  ASSERT_EQ(a.estimates.size(), b.estimates.size());
  for (std::size_t i = 0; i < a.estimates.size(); ++i) {
    const Estimate &x = a.estimates[i], &y = b.estimates[i];
    EXPECT_EQ(x.method, y.method);
    EXPECT_EQ(x.status, y.status) << x.message << " / " << y.message;
    EXPECT_EQ(x.message, y.message);
    for (const auto member :
         {&Estimate::backlash, &Estimate::lower, &Estimate::upper, &Estimate::backlash_angle,
          &Estimate::angle_lower, &Estimate::angle_upper, &Estimate::skewness})
      EXPECT_TRUE(same(x.*member, y.*member)) << x.method << ' ' << x.*member << ' ' << y.*member;
  }
  EXPECT_EQ(a.verdict.grade, b.verdict.grade);
  EXPECT_EQ(a.verdict.message, b.verdict.message);
  ASSERT_EQ(a.apd.has_value(), b.apd.has_value());
  if (!a.apd) return;
  EXPECT_EQ(a.apd->periods.size(), b.apd->periods.size());
  EXPECT_TRUE(same(a.apd->skewness, b.apd->skewness));
  EXPECT_TRUE(same(a.apd->noise, b.apd->noise));
  EXPECT_EQ(a.apd->total.counts(), b.apd->total.counts());
}

/// The APDs that a window carries hold its samples, each once.
void expect_apd_of_samples(const PeriodWindow& window, const ApdSettings& apd) {
  AmplitudeDistribution all(apd.layout), carried(apd.layout);
  for (const double value : window.record.column(apd.signal)) all.add(value);
  for (const PeriodResult& period : window.periods) carried.merge(period.apd);
  EXPECT_EQ(window.periods.size(), static_cast<std::size_t>(window.count));
  EXPECT_EQ(carried.counts(), all.counts());
}

/// Live and offline, on the same samples.
void expect_live_equals_offline(const record::Record& record, const ApdSettings& apd,
                                const std::string& what) {
  SCOPED_TRACE(what);
  const MonitoringCurve curve = test::linear_curve();
  const DiagnosisSettings settings = diagnosis_settings(apd);
  Live run(StreamSettings{apd, 60});
  run.push(record);
  EXPECT_EQ(run.stream.counters().restarts, 0);
  expect_same(diagnose(run.stream.latest(0), settings, &curve), diagnose(record, settings, &curve));
}

TEST(SampleStream, LiveEqualsOffline) {
  for (const double rate : {1000.0, 1024.0, 995.0, 333.0, 10000.0})
    for (const double start : {0.0, 1.7e9})
      for (const double jitter : {0.0, 0.1})
        for (const double period : {0.1, 0.0})
          for (const int settling : {0, 2}) {
            RecordRecipe recipe;
            recipe.rate = rate;
            recipe.start = start;
            recipe.jitter = jitter;
            recipe.noise = 1e-3;
            expect_live_equals_offline(make_record(recipe), apd_settings(period, settling),
                                       std::to_string(rate) + " Hz from " + std::to_string(start) +
                                           " jitter " + std::to_string(jitter) + " period " +
                                           std::to_string(period));
          }
}

TEST(SampleStream, LiveEqualsOfflineAtAnyLength) {
  for (const double period : {0.1, 0.0}) {
    RecordRecipe recipe;
    recipe.duration = 0.62;
    const record::Record record = make_record(recipe);
    const MonitoringCurve curve = test::linear_curve();
    const DiagnosisSettings settings = diagnosis_settings(apd_settings(period));
    SampleStream stream(StreamSettings{settings.apd, 60});
    for (std::size_t i = 0; i < record.size(); ++i) {
      stream.add(record.time[i], values_at(record, i));
      if (i % 7 != 0 && i % 100 > 2 && i % 100 < 97) continue;  // all borders, some between
      SCOPED_TRACE(i);
      const record::Record so_far = record.slice(0, 0.5 * (record.time[i] + (i + 1) * 1e-3));
      ASSERT_EQ(so_far.size(), i + 1);
      expect_same(diagnose(stream.latest(0), settings, &curve), diagnose(so_far, settings, &curve));
    }
  }
}

TEST(SampleStream, LiveEqualsOfflineWithGapsAndMissingChannels) {
  record::Record gaps = make_record({});
  test::cut_out(gaps, 1, 4);
  test::cut_out(gaps, 640, 700);
  test::cut_out(gaps, 900, 903);
  expect_live_equals_offline(gaps, apd_settings(), "gaps");
  expect_live_equals_offline(gaps, apd_settings(0), "gaps, unknown period");
  for (const record::Channel absent :
       {record::Channel::motor_torque, record::Channel::motor_position, record::Channel::load_position}) {
    record::Record record = make_record({});
    record.column(absent).clear();
    expect_live_equals_offline(record, apd_settings(), record::channel_name(absent));
    expect_live_equals_offline(record, apd_settings(0), record::channel_name(absent) + ", unknown period");
  }
  record::Record constant = make_record({});
  for (const record::Channel channel : record::kChannels)
    for (double& value : constant.column(channel)) value = 0.03;
  expect_live_equals_offline(constant, apd_settings(), "constant");
  expect_live_equals_offline(constant, apd_settings(0), "constant, unknown period");
  RecordRecipe slow;
  slow.frequency = 0.7;
  slow.duration = 11;
  slow.idle = 2.3;
  expect_live_equals_offline(make_record(slow), apd_settings(0, 1), "slow, after idling");
}

TEST(SampleStream, ReportsEachSettledPeriodOnceWithTheOfflineDistribution) {
  const record::Record record = make_record({});
  Live run(StreamSettings{apd_settings(), 60});
  run.push(record);
  ASSERT_EQ(run.periods.size(), 13u);  // 15 periods, 2 of them settling
  EXPECT_EQ(run.stream.periods(), 13);
  for (std::size_t i = 0; i < run.periods.size(); ++i) {
    EXPECT_EQ(run.periods[i].index, static_cast<long>(i) + 2);
    AmplitudeDistribution expected(kLayout);
    for (std::size_t k = 0; k < 100; ++k)
      expected.add(record.column(record::Channel::sensor_torque)[100 * (i + 2) + k]);
    EXPECT_EQ(run.periods[i].apd.counts(), expected.counts()) << i;
  }
}

TEST(SampleStream, LatestGivesExactlyTheSamplesAskedFor) {
  Live run(StreamSettings{apd_settings(), 60});
  const record::Record record = make_record({});
  run.push(record);
  for (const long count : {1L, 2L, 5L, 13L, 14L, 1000L}) {
    const record::Record latest = run.stream.latest(count).record;
    const std::size_t samples = 100 * std::min(count, 13L);
    ASSERT_EQ(latest.size(), samples);
    EXPECT_EQ(latest.time.front(), record.time[1500 - samples]);
    EXPECT_EQ(latest.time.back(), record.time.back());
    EXPECT_EQ(latest.column(record::Channel::motor_position).front(),
              record.column(record::Channel::motor_position)[1500 - samples]);
  }
}

// However much was forgotten: whole windows of the run, none cut, none twice.
TEST(SampleStream, TrimmedBuffersGiveWholeWindows) {
  for (const double rate : {1000.0, 1024.0, 995.0, 997.3})
    for (const double start : {0.0, 1.7e9})
      for (const double jitter : {0.0, 0.05})
        for (const double keep : {0.45, 0.5, 1.0}) {
          RecordRecipe recipe;
          recipe.duration = 6;
          recipe.rate = rate;
          recipe.start = start;
          recipe.jitter = jitter;
          const record::Record record = make_record(recipe);
          const ApdSettings apd = apd_settings();
          const auto grid = window_grid(record.time, apd.period);
          SampleStream stream(StreamSettings{apd, keep});
          for (std::size_t i = 0; i < record.size(); ++i) {
            stream.add(record.time[i], values_at(record, i));
            if (i % 41 != 0) continue;
            SCOPED_TRACE(std::to_string(rate) + " Hz, keep " + std::to_string(keep) + ", sample " +
                         std::to_string(i));
            EXPECT_LE(stream.kept().size(), 1.26 * keep * rate + 2);
            const long periods = stream.periods(), end = grid ? grid->completed(record.time[i]) : 0;
            // At least what the buffer surely holds, at most what has passed.
            EXPECT_GE(periods, std::min(std::max(0L, end - 2), static_cast<long>(keep / 0.1) - 2));
            EXPECT_LE(periods, std::max(0L, end - 2));
            for (const long count : {1L, periods}) {
              if (count > periods || periods == 0) continue;
              const PeriodWindow latest = stream.latest(count);
              expect_same(latest.record,
                          record.slice(grid->start(end - count),
                                       std::min(grid->start(end), std::nextafter(record.time[i], 1e300))));
              EXPECT_EQ(latest.count, count);
              expect_apd_of_samples(latest, apd);
            }
          }
        }
}

TEST(SampleStream, KeepsThreePeriodsHoweverLong) {
  RecordRecipe recipe;
  recipe.frequency = 0.1;
  recipe.rate = 100;
  recipe.duration = 95;
  Live run(StreamSettings{apd_settings(10, 0), 2});
  run.push(make_record(recipe));
  EXPECT_GE(run.stream.periods(), 2);
  EXPECT_LE(run.stream.kept().time.back() - run.stream.kept().time.front(), 1.26 * 30);
}

TEST(SampleStream, ABackwardStampStartsANewRun) {
  const record::Record record = make_record({});
  Live run(StreamSettings{apd_settings(), 60});
  run.push(record);
  const record::Record once = run.stream.latest(0).record;
  const auto first_periods = run.periods;
  run.periods.clear();
  run.push(record);  // a looped replay
  EXPECT_EQ(run.stream.counters().restarts, 1);
  EXPECT_NE(run.stream.counters().last_problem.find("back"), std::string::npos);
  EXPECT_EQ(run.stream.counters().accepted, 2 * static_cast<long>(record.size()));
  expect_same(run.stream.latest(0).record, once);
  ASSERT_EQ(run.periods.size(), first_periods.size());
  for (std::size_t i = 0; i < run.periods.size(); ++i) {
    EXPECT_EQ(run.periods[i].index, first_periods[i].index);
    EXPECT_EQ(run.periods[i].apd.counts(), first_periods[i].apd.counts());
  }
}

TEST(SampleStream, AJumpForwardStartsANewRunAndAGapDoesNot) {
  RecordRecipe recipe;
  const record::Record record = make_record(recipe);
  Live run(StreamSettings{apd_settings(), 60});
  run.push(record);
  EXPECT_EQ(run.stream.jump_limit(), 1);
  recipe.start = 1.5 + 0.9;
  run.push(make_record(recipe));
  EXPECT_EQ(run.stream.counters().restarts, 0);
  recipe.start = 100;
  const record::Record later = make_record(recipe);
  run.push(later);
  EXPECT_EQ(run.stream.counters().restarts, 1);
  EXPECT_NE(run.stream.counters().last_problem.find("jumped forward"), std::string::npos);
  EXPECT_EQ(run.stream.periods(), 13);
  EXPECT_EQ(run.stream.kept().time, later.time);
  EXPECT_EQ(SampleStream(StreamSettings{apd_settings(2.0), 60}).jump_limit(), 6);
}

TEST(SampleStream, RepeatedStampsAndValuesThatAreNotFiniteAreLeftOut) {
  const record::Record record = make_record({});
  Live clean(StreamSettings{apd_settings(), 60}), dirty(StreamSettings{apd_settings(), 60});
  clean.push(record);
  for (std::size_t i = 0; i < record.size(); ++i) {
    if (i % 50 == 20) {
      record::ChannelValues bad = values_at(record, i);
      bad[static_cast<std::size_t>(i % 100 == 20 ? record::Channel::sensor_torque
                                                 : record::Channel::motor_position)] =
          i % 3 ? std::nan("") : std::numeric_limits<double>::infinity();
      EXPECT_EQ(dirty.stream.add(record.time[i] - 1e-4, bad), nullptr);
    }
    dirty.stream.add(record.time[i], values_at(record, i));
    if (i % 100 == 7) dirty.stream.add(record.time[i], values_at(record, 0));
  }
  EXPECT_EQ(dirty.stream.counters().not_a_number, 30);
  EXPECT_EQ(dirty.stream.counters().repeated, 15);
  EXPECT_EQ(dirty.stream.counters().accepted, 1500);
  EXPECT_EQ(dirty.stream.counters().restarts, 0);
  EXPECT_FALSE(dirty.stream.counters().last_problem.empty());
  expect_same(dirty.stream.latest(0).record, clean.stream.latest(0).record);
  EXPECT_THROW(dirty.stream.add(std::nan(""), values_at(record, 0)), InvalidParameter);
}

TEST(SampleStream, BeginsWithTheSignal) {
  const record::Record record = make_record({});
  SampleStream stream(StreamSettings{apd_settings(), 60});
  record::ChannelValues values = values_at(record, 0);
  values[static_cast<std::size_t>(record::Channel::sensor_torque)] = std::nan("");
  for (int i = 0; i < 5; ++i) EXPECT_EQ(stream.add(-1 + 1e-3 * i, values), nullptr);
  EXPECT_EQ(stream.counters().accepted, 0);
  EXPECT_EQ(stream.counters().not_a_number, 5);
  EXPECT_NE(stream.counters().last_problem.find("sensor_torque"), std::string::npos);
  EXPECT_EQ(stream.periods(), 0);
  EXPECT_TRUE(stream.latest(0).record.time.empty());
}

// A driver's first message may lack a value; that must not lose the channel for good.
TEST(SampleStream, AChannelThatAppearsStartsANewRun) {
  const record::Record record = make_record({});
  Live run(StreamSettings{apd_settings(), 60});
  record::ChannelValues first = values_at(record, 0);
  first[static_cast<std::size_t>(record::Channel::motor_position)] = std::nan("");
  run.stream.add(-1e-3, first);
  run.push(record);
  EXPECT_EQ(run.stream.counters().restarts, 1);
  EXPECT_EQ(run.stream.counters().not_a_number, 0);
  EXPECT_EQ(run.stream.kept().column(record::Channel::motor_position).size(), record.size());
  EXPECT_EQ(run.stream.periods(), 13);
}

// One stray message with a velocity must not make all later ones useless.
TEST(SampleStream, AChannelThatIsGoneStartsANewRunAfterASecond) {
  RecordRecipe recipe;
  const record::Record record = make_record(recipe);
  SampleStream stream({apd_settings(), 60});
  const double dt = record.time[1] - record.time[0];
  record::ChannelValues stray = values_at(record, 0);
  stray[static_cast<std::size_t>(record::Channel::load_velocity)] = 0.5;
  stream.add(0, stray);
  for (std::size_t i = 0; i < record.size(); ++i) stream.add(record.time[i] + dt, values_at(record, i));
  const StreamCounters& counters = stream.counters();
  EXPECT_EQ(counters.restarts, 1);
  EXPECT_NEAR(counters.not_a_number * dt, stream.jump_limit(), 2 * dt);
  EXPECT_EQ(counters.accepted + counters.not_a_number, static_cast<long>(record.size()) + 1);
  EXPECT_NE(counters.last_problem.find("load_velocity"), std::string::npos) << counters.last_problem;
  EXPECT_FALSE(stream.kept().has(record::Channel::load_velocity));
}

TEST(SampleStream, UnknownPeriodIsFoundFromTheSamples) {
  RecordRecipe recipe;
  recipe.frequency = 8;  // 125 samples
  Live run(StreamSettings{apd_settings(0), 60});
  run.push(make_record(recipe));
  EXPECT_NEAR(run.stream.period(), 0.125, 1e-12);
  EXPECT_EQ(run.stream.periods(), 10);  // of 12, 2 settling
  // Reported from the time on when it was known.
  ASSERT_FALSE(run.periods.empty());
  EXPECT_EQ(run.periods.back().index, 11);
}

// A node may wait for hours before the excitation begins.
TEST(SampleStream, ExcitationAfterLongIdling) {
  RecordRecipe recipe;
  recipe.rate = 200;
  recipe.idle = 40;
  recipe.duration = 60;
  recipe.frequency = 5;
  record::Record record = make_record(recipe);
  Live run(StreamSettings{apd_settings(0), 4});
  std::size_t most = 0;
  for (std::size_t i = 0; i < record.size(); ++i) {
    run.stream.add(record.time[i], values_at(record, i));
    most = std::max(most, run.stream.kept().size());
  }
  EXPECT_LE(most, 1.26 * 4 * 200);  // memory stays bounded
  EXPECT_NEAR(run.stream.period(), 0.2, 1e-12);
  EXPECT_GE(run.stream.periods(), 15);
  const PeriodWindow latest = run.stream.latest(10);
  EXPECT_EQ(latest.record.size(), 400u);
  EXPECT_EQ(latest.periods.size(), 10u);
}

TEST(SampleStream, WithoutAnApdAllSamplesCount) {
  RecordRecipe recipe;
  const record::Record record = make_record(recipe);
  Live run(StreamSettings{std::nullopt, 60});
  run.push(record);
  expect_same(run.stream.latest(0).record, record);
  EXPECT_NEAR(run.stream.period(), 0.1, 1e-12);  // from motor_torque
  EXPECT_EQ(run.stream.periods(), 15);
  EXPECT_EQ(run.stream.latest(3).record.size(), 300u);
  record::Record still = record;
  for (double& torque : still.column(record::Channel::motor_torque)) torque = 0.01;
  Live none(StreamSettings{std::nullopt, 60});
  none.push(still);
  EXPECT_EQ(none.stream.periods(), 0);
  expect_same(none.stream.latest(5).record, still);
}

TEST(SampleStream, RefusesToKeepNothing) {
  for (const double keep : {0.0, -1.0, std::nan("")})
    EXPECT_THROW(SampleStream(StreamSettings{apd_settings(), keep}), InvalidParameter) << keep;
}

TEST(SampleStream, RestartForgetsEverything) {
  const record::Record record = make_record({});
  Live run(StreamSettings{apd_settings(), 60});
  run.push(record);
  run.stream.restart();
  EXPECT_EQ(run.stream.periods(), 0);
  EXPECT_TRUE(run.stream.kept().time.empty());
  EXPECT_TRUE(run.stream.latest(0).record.time.empty());
  run.push(record);
  EXPECT_EQ(run.stream.periods(), 13);
}

}  // namespace
}  // namespace backlash::diagnosis
