#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/diagnosis/verdict.h"

namespace backlash {
namespace {

constexpr double kToAngle = 50;  // rad/m

Estimate ok(const std::string& method, double value, double half) {
  Estimate e;
  e.method = method;
  e.status = Status::ok;
  e.backlash = value;
  e.lower = value - half;
  e.upper = value + half;
  e.backlash_angle = kToAngle * e.backlash;
  e.angle_lower = kToAngle * e.lower;
  e.angle_upper = kToAngle * e.upper;
  return e;
}

Estimate at_least(const std::string& method, double bound) {
  Estimate e;
  e.method = method;
  e.status = Status::above_range;
  e.lower = bound;
  e.angle_lower = kToAngle * bound;
  return e;
}

Estimate angles_only(Estimate e) {
  e.backlash = e.lower = e.upper = kNaN;
  return e;
}

Estimate unable(const std::string& method, Status status, const std::string& reason) {
  Estimate e;
  e.method = method;
  e.status = status;
  e.message = reason;
  return e;
}

const Limits kLimits = {false, 1e-4, 1.5e-4, 2e-4};

Verdict combined(const std::vector<Estimate>& estimates, const std::optional<Limits>& limits = kLimits,
                 const std::optional<Baseline>& baseline = std::nullopt) {
  return combine(estimates, limits, baseline);
}

TEST(Verdict, StandsOnTheNarrowestSoundEstimate) {
  const Verdict v = combined({ok("wide", 9e-5, 3e-5), unable("off", Status::out_of_domain, "x"),
                              ok("narrow", 8e-5, 1e-6), ok("middle", 8e-5, 1e-5)});
  EXPECT_EQ(v.estimate, 2);
  EXPECT_EQ(v.agreement, "agree");
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_NE(v.message.find("narrow"), std::string::npos) << v.message;
  EXPECT_NE(v.message.find("8e-05 m"), std::string::npos) << v.message;
  EXPECT_TRUE(std::isnan(v.growth));
}

TEST(Verdict, GradesAtTheLimits) {
  const std::vector<std::pair<double, Grade>> cases = {
      {0, Grade::good},         {0.999e-4, Grade::good},   {1e-4, Grade::watch}, {1.49e-4, Grade::watch},
      {1.5e-4, Grade::service}, {1.99e-4, Grade::service}, {2e-4, Grade::stop},  {1, Grade::stop}};
  for (const auto& [value, grade] : cases) {
    const Verdict v = combined({ok("m", value, 1e-6)});
    EXPECT_EQ(v.grade, grade) << value;
    EXPECT_EQ(v.agreement, "single");
    EXPECT_EQ(v.message.find(to_string(grade)), 0u) << v.message;
  }
}

TEST(Verdict, WithoutLimitsASoundEstimateIsGood) {
  EXPECT_EQ(combined({ok("m", 1, 0.1)}, std::nullopt).grade, Grade::good);
  EXPECT_EQ(combined({at_least("m", 1)}, std::nullopt).grade, Grade::cannot_tell);
}

TEST(Verdict, DisagreementIsToldWithTheNames) {
  Verdict v = combined({ok("a", 5e-5, 1e-6), ok("b", 6e-5, 1e-5), ok("c", 9e-5, 2e-6), ok("d", 2e-5, 2e-6)});
  EXPECT_EQ(v.estimate, 0);
  EXPECT_EQ(v.agreement, "disagree: c, d");
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_NE(v.message.find("disagree: c, d"), std::string::npos) << v.message;
  v = combined({ok("a", 5e-5, 1e-5), ok("b", 7e-5, 1e-5 + 1e-12)});  // the intervals just touch
  EXPECT_EQ(v.agreement, "agree");
}

TEST(Verdict, ALowerBoundAlone) {
  EXPECT_EQ(combined({at_least("m", 2.1e-4)}).grade, Grade::stop);
  EXPECT_EQ(combined({at_least("m", 1.2e-4)}).grade, Grade::watch);
  const Verdict low = combined({at_least("m", 0.5e-4)});  // it may well be more
  EXPECT_EQ(low.grade, Grade::cannot_tell);
  EXPECT_EQ(low.estimate, 0);
  EXPECT_EQ(low.agreement, "single");
  EXPECT_NE(low.message.find("at least 5e-05 m"), std::string::npos) << low.message;
}

TEST(Verdict, ALowerBoundBesideASoundEstimate) {
  Verdict v = combined({at_least("apd", 2e-4), ok("lost", 5e-5, 1e-6)});
  EXPECT_EQ(v.estimate, 1);
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_EQ(v.agreement, "disagree: apd");
  v = combined({at_least("apd", 2e-4), ok("lost", 2.1e-4, 1e-6)});
  EXPECT_EQ(v.agreement, "agree");
  EXPECT_EQ(v.grade, Grade::stop);
}

TEST(Verdict, NothingSoundCannotTellAndSaysWhy) {
  const Verdict v = combined(
      {unable("a", Status::ambiguous, "flat"), unable("b", Status::below_range, "high"),
       unable("c", Status::insufficient_data, "no channel"), unable("d", Status::above_range, "low")});
  EXPECT_EQ(v.grade, Grade::cannot_tell);
  EXPECT_EQ(v.estimate, -1);
  EXPECT_EQ(v.agreement, "none");
  for (const char* part : {"a: ambiguous (flat)", "b: below_range (high)",
                           "c: insufficient_data (no channel)", "d: above_range (low)"})
    EXPECT_NE(v.message.find(part), std::string::npos) << v.message;
  EXPECT_EQ(combined({}).grade, Grade::cannot_tell);
  EXPECT_EQ(combined({}).estimate, -1);
}

TEST(Verdict, BaselineLimitsTheGrowth) {
  Baseline baseline;
  baseline.backlash = 1.8e-4;
  Verdict v = combined({ok("m", 2.2e-4, 1e-6)}, kLimits, baseline);
  EXPECT_NEAR(v.growth, 0.4e-4, 1e-15);
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_NE(v.message.find("grown by"), std::string::npos) << v.message;
  EXPECT_EQ(combined({ok("m", 2.9e-4, 1e-6)}, kLimits, baseline).grade, Grade::watch);
  EXPECT_EQ(combined({ok("m", 1e-5, 1e-6)}, kLimits, baseline).grade, Grade::good);  // shrunk
  EXPECT_EQ(combined({at_least("m", 3.5e-4)}, kLimits, baseline).grade, Grade::service);
  // A baseline without that number says nothing about growth: the limits hold for the value.
  v = combined({ok("m", 1.6e-4, 1e-6)}, kLimits, Baseline());
  EXPECT_TRUE(std::isnan(v.growth));
  EXPECT_EQ(v.grade, Grade::service);
}

TEST(Verdict, Angles) {
  const Limits limits = {true, 1e-3, 2e-3, 3e-3};
  Verdict v = combined({angles_only(ok("m", 5e-5, 1e-6))}, limits);  // 2.5e-3 rad
  EXPECT_EQ(v.grade, Grade::service);
  EXPECT_NE(v.message.find("0.0025 rad"), std::string::npos) << v.message;
  Baseline baseline;
  baseline.backlash_angle = 2e-3;
  v = combined({angles_only(ok("m", 5e-5, 1e-6))}, limits, baseline);
  EXPECT_NEAR(v.growth, 0.5e-3, 1e-15);
  EXPECT_EQ(v.grade, Grade::good);
  EXPECT_EQ(combined({angles_only(ok("m", 5e-5, 1e-6))}, std::nullopt).grade, Grade::good);
  EXPECT_EQ(combined({angles_only(at_least("m", 5e-5))}, limits).grade, Grade::service);
  // A limit in metres cannot grade an angle.
  EXPECT_EQ(combined({angles_only(ok("m", 5e-5, 1e-6))}, kLimits).grade, Grade::cannot_tell);
}

TEST(Verdict, AnEstimateWithoutIntervalIsTheLastChoice) {
  Estimate blind = ok("blind", 5e-5, 1e-6);
  blind.angle_lower = blind.angle_upper = kNaN;
  EXPECT_EQ(combined({blind, ok("m", 5e-5, 1e-5)}).estimate, 1);
  EXPECT_EQ(combined({ok("m", 5e-5, 1e-5), blind}).estimate, 0);
}

TEST(Limits, ReadAndRefuse) {
  const auto read = [](const std::string& text) {
    return read_limits(YamlReader::from_text(text, "rig.yaml"));
  };
  const Limits limits = read("backlash: {watch: 1e-4, service: 2e-4, stop: 2e-4}");
  EXPECT_FALSE(limits.angular);
  EXPECT_EQ(limits.watch, 1e-4);
  EXPECT_EQ(limits.service, 2e-4);
  EXPECT_EQ(limits.stop, 2e-4);
  EXPECT_TRUE(read("backlash_angle: {watch: 1, service: 2, stop: 3}").angular);
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"backlash: {watch: 2, service: 1, stop: 3}", "service"},
      {"backlash: {watch: 1, service: 3, stop: 2}", "service"},
      {"backlash: {watch: 0, service: 1, stop: 2}", "watch"},
      {"backlash: {watch: 1, service: 2}", "stop"},
      {"backlash: {watch: 1, service: 2, stop: .inf}", "stop"},
      {"backlash: 3", "backlash"},
      {"play: {watch: 1, service: 2, stop: 3}", "backlash"}};
  for (const auto& [text, key] : cases) try {
      read(text);
      ADD_FAILURE() << text << " was accepted";
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
}

TEST(Grade, Names) {
  EXPECT_STREQ(to_string(Grade::good), "good");
  EXPECT_STREQ(to_string(Grade::watch), "watch");
  EXPECT_STREQ(to_string(Grade::service), "service");
  EXPECT_STREQ(to_string(Grade::stop), "stop");
  EXPECT_STREQ(to_string(Grade::cannot_tell), "cannot_tell");
}

}  // namespace
}  // namespace backlash
