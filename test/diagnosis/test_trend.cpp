// SPDX-License-Identifier: BSD-3-Clause
// Trends against closed forms and, for what their intervals promise, against many random histories.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/trend.h"

namespace backlash::diagnosis {
namespace {

constexpr double kDay = 86400, kYear = 365.25 * kDay, kStart = 1798761600;  // 2027-01-01

using Points = std::vector<TrendPoint>;

Points line(int count, double per_day, double start = 1e-4) {
  Points points;
  for (int i = 0; i < count; ++i) points.push_back({kStart + kDay * i, start + per_day * i});
  return points;
}

void expect_message(const Trend& trend, const std::string& part) {
  EXPECT_NE(trend.message.find(part), std::string::npos) << trend.message << "\nlacks: " << part;
}

TEST(Trend, AnExactLineIsFoundExactly) {
  const Trend t = find_trend(line(20, 1e-6), 150e-6, false);
  EXPECT_TRUE(t.known && t.grows && !t.exceeded);
  EXPECT_EQ(t.points, 20u);
  EXPECT_EQ(t.span, 19 * kDay);
  EXPECT_EQ(t.time, kStart + 19 * kDay);
  // 1e-9: rounding of values of 1e-4 and of times of 1e9 s.
  EXPECT_NEAR(t.rate * kDay / 1e-6, 1, 1e-9);
  EXPECT_NEAR(t.rate_lower / t.rate, 1, 1e-9);
  EXPECT_NEAR(t.rate_upper / t.rate, 1, 1e-9);
  EXPECT_NEAR(t.level / 119e-6, 1, 1e-9);
  ASSERT_TRUE(t.reaches);
  for (const double time : {t.reaches->time, t.reaches->earliest, t.reaches->latest})
    EXPECT_NEAR(time, kStart + 50 * kDay, 1);
  expect_message(t, "grows by 365 um per year (95 %: 365 to 365), reaches 150 um on 2027-02-20 00:00 (");
}

TEST(Trend, TheMessageHasUnitsThatFit) {
  expect_message(find_trend(line(20, 1e-4), std::nullopt, false),
                 "grows by 100 um per day (95 %: 100 to 100)");
  expect_message(find_trend(line(20, 1e-6 / 3), std::nullopt, true), "grows by 0.122 mrad per year");
  expect_message(find_trend(line(20, -1e-6), std::nullopt, false), "no trend: shrinks by -365 um per year");
}

TEST(Trend, ALimitBehindIsExceededSince) {
  const Trend t = find_trend(line(20, 1e-6), 110e-6, false);
  EXPECT_TRUE(t.exceeded);
  ASSERT_TRUE(t.reaches);
  EXPECT_NEAR(t.reaches->time, kStart + 10 * kDay, 1);
  expect_message(t, ", exceeds 110 um since 2027-01-11");
}

TEST(Trend, SaysWhyThereIsNone) {
  const auto none = [](const Points& points, const std::string& reason) {
    const Trend t = find_trend(points, 1e-3, false);
    EXPECT_FALSE(t.grows);
    EXPECT_FALSE(t.reaches);
    expect_message(t, "no trend: " + reason);
    return t;
  };
  EXPECT_TRUE(std::isnan(none({}, "0 points at different times, at least 10 are needed").level));
  EXPECT_FALSE(none(line(9, 1e-6), "9 points at different times").known);
  EXPECT_DOUBLE_EQ(none(line(9, 1e-6), "9 points").level, 104e-6);
  Points same = line(9, 1e-6), day = line(20, 1e-6);
  for (const double value : {1.0, 2.0, 3.0}) same.push_back({kStart, value});
  none(same, "9 points at different times");
  for (TrendPoint& p : day) p.time = kStart + (p.time - kStart) / 20;
  none(day, "the points span 22.8 h, at least 24 h are needed");
  const Trend flat = none(line(20, 0), "growth is not distinguished from none: 0 um per year (95 %: 0 to 0)");
  EXPECT_TRUE(flat.known);
  EXPECT_EQ(flat.rate, 0);
}

TEST(Trend, WithoutGrowthALimitMayBeExceededAllTheSame) {
  for (const int count : {3, 20}) {
    const Trend t = find_trend(line(count, 0), 90e-6, false);
    EXPECT_TRUE(t.exceeded);
    ASSERT_TRUE(t.reaches);
    EXPECT_TRUE(std::isnan(t.reaches->time));
    EXPECT_EQ(t.reaches->latest, t.time);
    expect_message(t, "; exceeds 90 um already");
  }
}

TEST(Trend, TheOrderOfPointsAndValuesThatAreNoneDoNotMatter) {
  Points points = line(50, 1e-6);
  Random random(3);
  for (TrendPoint& p : points) p.value += 1e-6 * random.normal();
  Points mixed = points;
  for (std::size_t i = mixed.size(); i > 1; --i) std::swap(mixed[i - 1], mixed[random.below(i)]);
  mixed.push_back({kStart, std::nan("")});
  mixed.push_back({HUGE_VAL, 1});
  const Trend a = find_trend(points, 2e-4, false), b = find_trend(mixed, 2e-4, false);
  EXPECT_EQ(a.message, b.message);
  EXPECT_EQ(a.rate_lower, b.rate_lower);
}

TEST(Trend, TiesOfTimesNarrowKendallsTest) {
  // 10 times, twice each: 20 points, 180 slopes, variance [20 19 45 - 10 (2 1 9)] / 18 = 940, so that without
  // memory of the errors (180 - 1.96 sqrt(940)) / 2 = 59.95: the 59th slope from either end, or one
  // nearer to the ends where the errors seem to have some.
  Points points;
  std::vector<double> slopes;
  Random random(5);
  for (int i = 0; i < 10; ++i)
    for (int k = 0; k < 2; ++k) points.push_back({kStart + kDay * i, random.normal()});
  for (const TrendPoint& a : points)
    for (const TrendPoint& b : points)
      if (a.time > b.time) slopes.push_back((a.value - b.value) / (a.time - b.time));
  std::sort(slopes.begin(), slopes.end());
  ASSERT_EQ(slopes.size(), 180u);
  const Trend t = find_trend(points, std::nullopt, false);
  EXPECT_EQ(t.rate, 0.5 * (slopes[89] + slopes[90]));
  const auto place = std::lower_bound(slopes.begin(), slopes.end(), t.rate_lower) - slopes.begin();
  EXPECT_EQ(slopes[static_cast<std::size_t>(place)], t.rate_lower);
  EXPECT_EQ(slopes[static_cast<std::size_t>(179 - place)], t.rate_upper);
  EXPECT_LE(place, 58);
  EXPECT_GE(place, 35);  // errors without memory: the variance is not taken as more than 2.2 times as large
}

/// Random histories of which the truth is known.
struct Histories {
  int points = 100;
  double memory = 0;       // correlation of successive errors, of the part that has one
  double independent = 0;  // share of the variance without memory
  double outliers = 0;     // share of the points that are 20 standard deviations too high
  bool uneven = false;     // exponentially distributed distances of the points
  double growth = 0;       // standard deviations over the whole span

  Points draw(Random& random) const {
    Points all;
    double time = kStart, slow = random.normal();
    for (int i = 0; i < points; ++i) {
      const double distance = uneven ? -std::log(1 - random.uniform()) : 1;
      const double kept = memory > 0 ? std::pow(memory, distance) : 0;
      time += kDay * distance;
      slow = kept * slow + std::sqrt(1 - kept * kept) * random.normal();
      double error = std::sqrt(1 - independent) * slow + std::sqrt(independent) * random.normal();
      if (random.uniform() < outliers) error += 20;
      all.push_back({time, rate() * (time - kStart) + error});
    }
    return all;
  }
  double rate() const { return growth / (points * kDay); }
};

struct Rates {
  double coverage = 0, alarms = 0, dates = 0;
};

Rates tried(const Histories& histories, int trials, std::uint64_t seed) {
  Random random(seed);
  Rates rates;
  const double limit = 1.5 * histories.growth;
  int dated = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Trend t = find_trend(histories.draw(random), limit, false);
    EXPECT_TRUE(t.known);
    rates.coverage += t.rate_lower <= histories.rate() && histories.rate() <= t.rate_upper;
    rates.alarms += t.grows;
    if (!t.grows || histories.growth == 0) continue;
    const double truth = kStart + limit / histories.rate();
    ++dated;
    EXPECT_LE(t.reaches->earliest, t.reaches->time);
    EXPECT_LE(t.reaches->time, t.reaches->latest);
    rates.dates += t.reaches->earliest <= truth && truth <= t.reaches->latest;
  }
  rates.coverage /= trials;
  rates.alarms /= trials;
  if (dated > 0) rates.dates /= dated;
  return rates;
}

/// Three standard deviations of a share of `trials` about `share`.
double scatter(double share, int trials) {
  return 3 * std::sqrt(share * (1 - share) / trials);
}

// Where the errors have no memory the intervals allow for one that cannot be excluded: they hold more often
// than 95 %, growth is reported by mistake less often than 2.5 %, but the interval must not become useless.
TEST(Trend, IntervalsHoldForIndependentErrors) {
  constexpr int kTrials = 400;
  for (const int points : {10, 20, 60, 150}) {
    const Rates still = tried({points}, kTrials, 11);
    EXPECT_GE(still.coverage, 0.95 - scatter(0.95, kTrials)) << points;
    EXPECT_LE(still.alarms, 0.025 + scatter(0.025, kTrials)) << points;
    Histories growing{points};
    growing.growth = 5;
    const Rates rates = tried(growing, kTrials, 12);
    EXPECT_GE(rates.coverage, 0.95 - scatter(0.95, kTrials)) << points;
    EXPECT_GE(rates.dates, 0.95 - scatter(0.95, kTrials)) << points;
  }
  Random random(13);
  double width = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const Trend t = find_trend(Histories{100}.draw(random), std::nullopt, false);
    width += (t.rate_upper - t.rate_lower) * 100 * kDay / 50;
  }
  // Least squares with known memory: 2 1.96 sqrt(12 / 100) = 1.36 standard deviations over the span.
  EXPECT_LT(width, 1.6 * 1.36);
}

// How long errors remember is not well known from few points: up to 4 % less than promised is taken.
TEST(Trend, IntervalsHoldForErrorsThatHangTogether) {
  constexpr int kTrials = 300;
  std::vector<Histories> kinds(5);
  kinds[0].points = 50, kinds[0].memory = 0.5;
  kinds[1].points = 150, kinds[1].memory = 0.8;
  kinds[2].points = 150, kinds[2].memory = 0.9, kinds[2].independent = 0.5;
  kinds[3].memory = 0.8, kinds[3].uneven = true;
  kinds[4].points = 200, kinds[4].memory = 0.95;
  for (Histories& kind : kinds) {
    const std::string name = std::to_string(kind.points) + " " + std::to_string(kind.memory);
    const Rates still = tried(kind, kTrials, 21);
    EXPECT_GE(still.coverage, 0.91 - scatter(0.91, kTrials)) << name;
    EXPECT_LE(still.alarms, 0.045 + scatter(0.045, kTrials)) << name;
    kind.growth = 15;
    const Rates growing = tried(kind, kTrials, 22);
    EXPECT_GE(growing.coverage, 0.91 - scatter(0.91, kTrials)) << name;
    EXPECT_GE(growing.dates, 0.91 - scatter(0.91, kTrials)) << name;
  }
}

TEST(Trend, UpToAFifthOfThePointsMayBeWrong) {
  constexpr int kTrials = 300;
  Histories wild;
  wild.outliers = 0.2;
  wild.growth = 10;
  const Rates rates = tried(wild, kTrials, 31);
  EXPECT_GE(rates.coverage, 0.95 - scatter(0.95, kTrials));
  EXPECT_EQ(rates.alarms, 1);
  EXPECT_GE(rates.dates, 0.95 - scatter(0.95, kTrials));
}

TEST(Trend, AMillionPointsSayTheSameAsFew) {
  // A point per minute for two years, half a micrometre of growth a month, errors of 5 um that a day forgets.
  Random random(41);
  const double rate = 6e-6 / kYear, kept = std::exp(-60 / kDay);
  Points all, some;
  double slow = random.normal();
  for (int i = 0; i < 1'000'000; ++i) {
    slow = kept * slow + std::sqrt(1 - kept * kept) * random.normal();
    const double time = kStart + 60.0 * i;
    all.push_back({time, 1e-4 + rate * (time - kStart) + 3e-6 * slow + 4e-6 * random.normal()});
    if (i % 2500 == 0) some.push_back(all.back());  // few enough to be used one by one
  }
  const Trend many = find_trend(all, 150e-6, false), few = find_trend(some, 150e-6, false);
  EXPECT_EQ(many.points, 1'000'000u);
  for (const Trend* t : {&many, &few}) {
    EXPECT_TRUE(t->grows) << t->message;
    // One history in twenty is outside its interval, one in ten thousand by as much again.
    EXPECT_NEAR(t->rate, rate, t->rate_upper - t->rate_lower);
  }
  EXPECT_GE(many.rate, few.rate_lower);
  EXPECT_LE(many.rate, few.rate_upper);
  EXPECT_LE(many.rate_upper - many.rate_lower, few.rate_upper - few.rate_lower);
  // An exact line of as many points stays one.
  for (TrendPoint& p : all) p.value = 1e-4 + rate * (p.time - kStart);
  EXPECT_NEAR(find_trend(all, std::nullopt, false).rate / rate, 1, 1e-6);
}

TEST(Trend, PointsAreThoseAfterTheLastBaselineOfThisRig) {
  std::vector<HistoryEntry> entries(8);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    entries[i].time = static_cast<double>(i);
    entries[i].backlash = 10.0 + static_cast<double>(i);
    entries[i].backlash_angle = 20.0 + static_cast<double>(i);
    entries[i].rig_digest = "a";
  }
  EXPECT_EQ(trend_points(entries, false, "a").size(), 8u);
  entries[1].event = entries[3].event = kBaselineEvent;
  entries[5].rig_digest = "b";
  entries[6].backlash = kNaN;
  const Points lengths = trend_points(entries, false, "a"), angles = trend_points(entries, true, "a");
  ASSERT_EQ(lengths.size(), 2u);
  EXPECT_EQ(lengths[0].time, 4);
  EXPECT_EQ(lengths[1].value, 17);
  ASSERT_EQ(angles.size(), 3u);
  EXPECT_EQ(angles[1].value, 26);
  EXPECT_TRUE(trend_points({}, false, "").empty());
}

}  // namespace
}  // namespace backlash::diagnosis
