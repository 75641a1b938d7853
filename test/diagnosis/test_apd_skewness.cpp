// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/apd_skewness.h"
#include "backlash_diagnosis/diagnosis/sample_stream.h"
#include "support/curve.h"
#include "support/records.h"

namespace backlash::diagnosis {
namespace {

using test::linear_curve;
using test::make_record;
using test::RecordRecipe;

ApdSettings settings(double period = 0.1, int settling = 0) {
  return {record::Channel::sensor_torque, period, settling, {60, -0.4, 0.4}};
}

ApdResult apd_of(const record::Record& record, const ApdSettings& apd) {
  return analyse_apd(cut_periods(record, apd), apd);
}

Estimate estimate(const record::Record& record, const MonitoringCurve& curve,
                  const ApdSettings& apd = settings()) {
  const ApdResult result = apd_of(record, apd);
  return estimate_apd_skewness(result, match_curve(record, result, apd, &curve), &curve);
}

TEST(AnalyseApd, MeanOverThePeriodsOfASquareRoot) {
  // Two periods with different distributions: n samples in class 0, 100 - n in class 1 of two; skewness of
  // two class values is 0, of three with one empty it has a closed form.
  record::Record record;
  for (int i = 0; i < 300; ++i) {
    record.time.push_back(i * 1e-3);
    record.column(record::Channel::sensor_torque)
        .push_back(i < 100   ? 0.5
                   : i < 200 ? (i % 2 ? 0.5 : 1.5)
                             : 2.5);
  }
  const ApdSettings apd = {record::Channel::sensor_torque, 0.1, 0, {3, 0, 3}};
  const ApdResult result = apd_of(record, apd);
  ASSERT_EQ(result.periods.size(), 3u);
  const double one = 1 / std::sqrt(2.0);   // (M - 2) / sqrt(M - 1) with M = 3
  const double two = -1 / std::sqrt(2.0);  // two equal and one empty: (M - 4) / sqrt(2 (M - 2))
  EXPECT_NEAR(result.periods[0].apd.skewness(), one, 1e-12);
  EXPECT_NEAR(result.periods[1].apd.skewness(), two, 1e-12);
  EXPECT_NEAR(result.skewness, (2 * one + two) / 3, 1e-12);
  EXPECT_EQ(result.total.counts(), (std::vector<std::size_t>{150, 50, 100}));
  EXPECT_EQ(result.period, 0.1);
  EXPECT_EQ(result.incomplete, 0);
}

TEST(AnalyseApd, LeavesOutSettlingAndWindowsWithGaps) {
  record::Record record = make_record({});
  EXPECT_EQ(apd_of(record, settings(0.1, 2)).periods.size(), 13u);
  EXPECT_EQ(apd_of(record, settings(0.1, 15)).periods.size(), 0u);
  EXPECT_TRUE(std::isnan(apd_of(record, settings(0.1, 15)).skewness));
  test::cut_out(record, 720, 740);
  const ApdResult result = apd_of(record, settings(0.1, 2));
  EXPECT_EQ(result.periods.size(), 12u);
  EXPECT_EQ(result.incomplete, 1);
}

TEST(AnalyseApd, RecordsThatGiveNothing) {
  EXPECT_TRUE(apd_of(record::Record(), settings()).periods.empty());
  record::Record record = make_record({});
  record.column(record::Channel::sensor_torque).clear();
  EXPECT_TRUE(apd_of(record, settings()).periods.empty());
  record::Record outside = make_record({});
  for (double& v : outside.column(record::Channel::sensor_torque)) v += 7;
  const ApdResult result = apd_of(outside, settings());
  EXPECT_TRUE(result.periods.empty());
  EXPECT_EQ(result.incomplete, 15);  // no sample inside the classes
  EXPECT_THROW(apd_of(record, {record::Channel::sensor_torque, 0.1, 0, {1, 0, 1}}), InvalidParameter);
}

TEST(AnalyseApd, EstimatesTheNoise) {
  RecordRecipe recipe;
  recipe.duration = 10;
  recipe.noise = 0.002;
  // Five standard errors with 990 stretches of 10 samples, see test_noise.cpp: 8 %.
  const ApdResult many = apd_of(make_record(recipe), settings(0.1, 2));
  EXPECT_NEAR(many.noise / 0.002, 1, 0.08);
  EXPECT_EQ(many.noise_range.lower, many.noise);
  recipe.duration = 0.1;
  const ApdResult one = apd_of(make_record(recipe), settings());
  EXPECT_TRUE(std::isnan(one.noise));
  EXPECT_EQ(one.noise_range.lower, 0);
  EXPECT_GT(one.noise_range.upper, 0.001);
}

TEST(ExcitationPeriod, PrefersTheMotorTorque) {
  record::Record record = make_record({});
  EXPECT_NEAR(excitation_period(record, record::Channel::sensor_torque), 0.1, 1e-12);
  for (double& v : record.column(record::Channel::sensor_torque)) v = 0;
  EXPECT_NEAR(excitation_period(record, record::Channel::sensor_torque), 0.1, 1e-12);
  record.column(record::Channel::motor_torque).clear();
  EXPECT_EQ(excitation_period(record, record::Channel::sensor_torque), 0);
  EXPECT_EQ(excitation_period(record::Record(), record::Channel::sensor_torque), 0);
}

TEST(CutPeriods, ByThePeriodThatIsFoundFirst) {
  EXPECT_EQ(cut_periods(record::Record(), settings(0.3)).period, 0.3);
  EXPECT_EQ(cut_periods(record::Record(), settings(0)).period, 0);
  EXPECT_NEAR(cut_periods(make_record({}), settings(0)).period, 0.1, 1e-12);
  RecordRecipe recipe;  // found before the excitation changes
  record::Record record = make_record(recipe);
  recipe.frequency = 4;
  recipe.start = 1.5;
  recipe.duration = 20;
  const record::Record later = make_record(recipe);
  record.time.insert(record.time.end(), later.time.begin(), later.time.end());
  for (const record::Channel channel : record::kChannels)
    record.column(channel).insert(record.column(channel).end(), later.column(channel).begin(),
                                  later.column(channel).end());
  EXPECT_NEAR(cut_periods(record, settings(0)).period, 0.1, 1e-12);
  recipe.duration = 0.6;  // 2.4 periods: found in the whole record, not at 0.25 or 0.5 s
  EXPECT_NEAR(cut_periods(make_record(recipe), settings(0)).period, 0.25, 1e-12);
}

TEST(CutPeriods, CutsExactly) {
  RecordRecipe recipe;
  recipe.duration = 1.234;
  for (const double start : {0.0, 1.7e9}) {
    recipe.start = start;
    const record::Record record = make_record(recipe);
    const PeriodWindow cut = cut_periods(record, settings(0.1, 2));
    EXPECT_EQ(cut.record.size(), 1000u);
    EXPECT_EQ(cut.count, 10);
    EXPECT_EQ(cut.periods.size(), 10u);
    EXPECT_EQ(cut.record.name, record.name);
    EXPECT_EQ(cut.record.time.front(), record.time[200]);
    EXPECT_EQ(cut.record.time.back(), record.time[1199]);
    EXPECT_EQ(cut_periods(record, settings(0.1, 2), 3).record.time.front(), record.time[900]);
    EXPECT_EQ(cut_periods(record, settings(0.1, 2), 3).periods.size(), 3u);
    EXPECT_EQ(cut_periods(record, settings(0.1, 2), 99).record.time.front(), record.time[200]);
    EXPECT_EQ(cut_periods(record, settings(0.1, 11)).record.size(), 100u);
    EXPECT_EQ(cut_periods(record, settings(0.1, 12)).record.size(), 0u);
    EXPECT_EQ(cut_periods(record, settings(5)).record.size(), 0u);
    EXPECT_EQ(cut_periods(record, settings(0, 2)).record.size(), 1000u);
    EXPECT_EQ(cut_periods(record, std::nullopt, 3).record.time.front(), record.time[900]);  // by motor_torque
  }
  EXPECT_EQ(cut_periods(record::Record(), settings()).record.size(), 0u);
  EXPECT_EQ(cut_periods(record::Record(), settings(0)).record.size(), 0u);
}

// What a stream takes for a new run is a hole in a record, and other estimators need not have the signal.
TEST(CutPeriods, ARecordIsOneRun) {
  record::Record record = make_record({});
  for (std::size_t i = 850; i < record.size(); ++i) record.time[i] += 30;  // whole periods later
  const PeriodWindow cut = cut_periods(record, settings(0.1, 2));
  EXPECT_EQ(cut.record.size(), 1300u);
  EXPECT_EQ(cut.record.time.front(), record.time[200]);
  EXPECT_EQ(analyse_apd(cut, settings()).periods.size(), 12u);
  EXPECT_EQ(analyse_apd(cut, settings()).incomplete, 2);  // both ends of the hole
  record.column(record::Channel::sensor_torque).clear();
  const PeriodWindow without = cut_periods(record, settings(0.1, 2));
  EXPECT_EQ(without.record.size(), 1300u);
  EXPECT_TRUE(without.periods.empty());
}

TEST(TravelOf, IgnoresThePeaks) {
  std::vector<double> position;
  for (int i = 0; i < 1000; ++i) position.push_back(i < 500 ? -1 : 2);
  position[3] = -50;
  position[700] = 50;
  EXPECT_EQ(travel_of(position), 3);
  EXPECT_TRUE(std::isnan(travel_of({})));
}

TEST(EstimateApdSkewness, InvertsTheMeanSkewness) {
  RecordRecipe recipe;
  recipe.noise = 1e-3;
  const record::Record record = make_record(recipe);
  const ApdResult apd = apd_of(record, settings());
  const MonitoringCurve curve = linear_curve();
  const Estimate e = estimate(record, curve), expected = curve.invert(apd.skewness, 15, apd.noise_range);
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_EQ(e.backlash, expected.backlash);
  EXPECT_EQ(e.lower, expected.lower);
  EXPECT_EQ(e.upper, expected.upper);
  EXPECT_EQ(e.skewness, apd.skewness);
}

TEST(EstimateApdSkewness, ExactlyTwoPeriodsAreEnough) {
  RecordRecipe recipe;
  for (const int periods : {1, 2, 3}) {
    recipe.duration = 0.1 * periods;
    const Estimate e = estimate(make_record(recipe), linear_curve());
    EXPECT_EQ(e.status, Status::ok) << periods << ": " << e.message;
  }
}

// A single period does not show the noise as a difference to the next.
TEST(EstimateApdSkewness, OfASinglePeriodAllNoiseThatItMayHoldCounts) {
  RecordRecipe recipe;
  recipe.duration = 0.1;
  recipe.noise = 0.001;
  MonitoringCurve curve = linear_curve();
  for (CurvePoint& point : curve.points) point.cells[1].mean += 1;  // at the largest noise
  const ApdResult apd = apd_of(make_record(recipe), settings());
  const Estimate e = estimate(make_record(recipe), curve), silent = curve.invert(apd.skewness, 1, 0);
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_EQ(e.lower, silent.lower);
  const double noise = signal::with_standard_error(apd.noise_range, 100).upper;
  EXPECT_NEAR(e.upper - silent.upper, 100 * noise / -test::kCurveSlope, 1e-12);  // 1 per 0.01 N m
  recipe.noise = 0.02;  // more than the curve covers, and nothing distinguishes it from ringing
  const Estimate noisy = estimate(make_record(recipe), linear_curve());
  EXPECT_EQ(noisy.status, Status::insufficient_data);
  EXPECT_NE(noisy.message.find("noise"), std::string::npos) << noisy.message;
}

struct Variant {
  std::string name;
  std::function<void(record::Record&)> change;
  Status status;
  std::string reason;  // part of the message
};

void scale(std::vector<double>& values, double factor) {
  for (double& v : values) v *= factor;
}

TEST(EstimateApdSkewness, RecordsOutsideTheDomainAreRefusedWithTheReason) {
  const auto remake = [](const std::function<void(RecordRecipe&)>& change) {
    return [change](record::Record& record) {
      RecordRecipe recipe;
      change(recipe);
      record = make_record(recipe);
    };
  };
  const auto sine = [](double amplitude) {
    return [amplitude](record::Record& record) {
      for (std::size_t i = 0; i < record.size(); ++i)
        record.column(record::Channel::motor_torque)[i] =
            amplitude * std::sin(2 * M_PI * 10 * record.time[i]);
    };
  };
  const std::vector<Variant> variants = {
      {"20 % more torque", remake([](auto& r) { r.amplitude *= 1.2; }), Status::out_of_domain,
       "excitation level"},
      {"20 % less torque", remake([](auto& r) { r.amplitude *= 0.8; }), Status::out_of_domain,
       "excitation level"},
      {"6 % more torque", remake([](auto& r) { r.amplitude *= 1.06; }), Status::out_of_domain,
       "excitation level"},
      {"8 Hz", remake([](auto& r) { r.frequency = 8; }), Status::out_of_domain, "excitation frequency"},
      {"12.5 Hz", remake([](auto& r) { r.frequency = 12.5; }), Status::out_of_domain, "excitation frequency"},
      {"5 Hz", remake([](auto& r) { r.frequency = 5; }), Status::out_of_domain, "excitation frequency"},
      {"20 Hz", remake([](auto& r) { r.frequency = 20; }), Status::out_of_domain, "excitation frequency"},
      {"2 kHz", remake([](auto& r) { r.rate = 2000; }), Status::out_of_domain, "sampling rate"},
      {"950 Hz", remake([](auto& r) { r.rate = 950; }), Status::out_of_domain, "sampling rate"},
      {"sine", sine(0.05), Status::out_of_domain, "excitation level"},
      {"sine of the same level", sine(0.05 * std::sqrt(2.0)), Status::out_of_domain, "excitation amplitude"},
      {"no torque", [](record::Record& r) { scale(r.column(record::Channel::motor_torque), 0); },
       Status::out_of_domain, "constant"},
      {"dead sensor", [](record::Record& r) { scale(r.column(record::Channel::sensor_torque), 0); },
       Status::out_of_domain, "does not move"},
      {"too noisy", remake([](auto& r) { r.noise = 0.02; }), Status::out_of_domain, "noise"},
      {"saturated",
       [](record::Record& r) {
         for (double& v : r.column(record::Channel::sensor_torque)) v = std::clamp(v, -0.06, 0.06);
       },
       Status::out_of_domain, "saturated"},
      {"output moves",
       [](record::Record& r) {
         for (std::size_t i = 0; i < r.size(); ++i)
           r.column(record::Channel::load_position)[i] = 2e-3 * std::sin(60 * r.time[i]);
       },
       Status::out_of_domain, "output moves"},
      {"motor travels too far", remake([](auto& r) { r.travel = 0.03; }), Status::out_of_domain,
       "motor travels"},
      {"no signal", [](record::Record& r) { r.column(record::Channel::sensor_torque).clear(); },
       Status::insufficient_data, "no sensor_torque"},
      {"half a period", [](record::Record& r) { r = r.slice(0, 0.05); }, Status::insufficient_data,
       "too short"},
      {"a few samples", [](record::Record& r) { r = r.slice(0, 0.004); }, Status::insufficient_data,
       "too short"},
      {"one sample", [](record::Record& r) { r = r.slice(0, 0.0005); }, Status::insufficient_data,
       "too short"},
      {"offset out of the classes",
       [](record::Record& r) {
         for (double& v : r.column(record::Channel::sensor_torque)) v += 3;
       },
       Status::out_of_domain, "signal level"},
  };
  for (const Variant& variant : variants) {
    record::Record record = make_record({});
    variant.change(record);
    const Estimate e = estimate(record, linear_curve());
    EXPECT_EQ(e.status, variant.status) << variant.name << ": " << e.message;
    EXPECT_NE(e.message.find(variant.reason), std::string::npos) << variant.name << ": " << e.message;
    EXPECT_TRUE(std::isnan(e.backlash) && std::isnan(e.lower) && std::isnan(e.upper)) << variant.name;
  }
}

TEST(EstimateApdSkewness, GapsInEveryPeriod) {
  record::Record record = make_record({});
  for (int k = 14; k >= 0; --k) test::cut_out(record, 100 * k + 40, 100 * k + 55);
  const Estimate e = estimate(record, linear_curve());
  EXPECT_EQ(e.status, Status::insufficient_data);
  EXPECT_NE(e.message.find("15 had gaps"), std::string::npos) << e.message;
}

TEST(EstimateApdSkewness, WithoutMotorTorqueTheSignalStandsIn) {
  const auto without = [](RecordRecipe recipe) {
    record::Record record = make_record(recipe);
    record.column(record::Channel::motor_torque).clear();
    return estimate(record, linear_curve());
  };
  EXPECT_EQ(without({}).status, Status::ok) << without({}).message;
  RecordRecipe recipe;
  recipe.frequency = 8;
  EXPECT_NE(without(recipe).message.find("excitation frequency"), std::string::npos);
  recipe = {};
  recipe.amplitude = 0.03;
  EXPECT_NE(without(recipe).message.find("signal level"), std::string::npos);
  recipe.amplitude = 0.1;
  EXPECT_NE(without(recipe).message.find("signal level"), std::string::npos);
}

TEST(EstimateApdSkewness, ConditionsOfTheCurve) {
  const record::Record record = make_record({});
  MonitoringCurve curve = linear_curve();
  curve.conditions.signal = "motor_velocity";
  EXPECT_NE(estimate(record, curve).message.find("signal motor_velocity"), std::string::npos);
  curve = linear_curve();
  curve.conditions.apd.classes = 61;
  EXPECT_NE(estimate(record, curve).message.find("class layout"), std::string::npos);
  curve = linear_curve();
  curve.conditions.output_locked = false;
  record::Record moving = record;
  for (std::size_t i = 0; i < moving.size(); ++i) moving.column(record::Channel::load_position)[i] = i;
  EXPECT_EQ(estimate(moving, curve).status, Status::ok);
  const ApdResult apd = apd_of(record, settings());
  const Estimate none = estimate_apd_skewness(apd, match_curve(record, apd, settings(), nullptr), nullptr);
  EXPECT_EQ(none.status, Status::insufficient_data);
  EXPECT_NE(none.message.find("no monitoring curve"), std::string::npos);
}

// Spikes and noise on the torque command are no other excitation.
TEST(EstimateApdSkewness, AFewSpikesOnTheMotorTorqueAreAllowed) {
  record::Record record = make_record({});
  for (const int i : {17, 300, 812, 1400}) record.column(record::Channel::motor_torque)[i] = 0.5;
  EXPECT_EQ(estimate(record, linear_curve()).status, Status::ok) << estimate(record, linear_curve()).message;
}

TEST(EstimateApdSkewness, SamplesThatAreNotFinite) {
  record::Record record = make_record({});
  record.column(record::Channel::sensor_torque)[333] = std::nan("");
  record.column(record::Channel::sensor_torque)[777] = std::numeric_limits<double>::infinity();
  const Estimate e = estimate(record, linear_curve());  // one sample outside the classes in two of 15 periods
  EXPECT_EQ(e.status, Status::ok) << e.message;
  EXPECT_NEAR(e.backlash, estimate(make_record({}), linear_curve()).backlash, 2e-6);
}

}  // namespace
}  // namespace backlash::diagnosis
