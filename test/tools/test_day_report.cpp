// SPDX-License-Identifier: BSD-3-Clause
// day_report as a user calls it, on files as the monitors write them.
#include <ctime>
#include <nlohmann/json.hpp>

#include "backlash_diagnosis/base/utc.h"
#include "backlash_diagnosis/diagnosis/change_log.h"
#include "backlash_diagnosis/diagnosis/history.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kNoon = 1798804800;  // 2027-01-01T12:00:00Z
constexpr double kHour = 3600;

class DayReport : public CommandTest {
 protected:
  /// Each hour of two days that end at noon; `play` in mrad, NaN: cannot tell.
  void history(const std::string& joint, const std::string& grade, double play, double end = kNoon) {
    diagnosis::History file({path("history/" + joint + ".csv")});
    for (int hour = -48; hour <= 0; ++hour) {
      diagnosis::HistoryEntry e;
      e.time = end + hour * kHour;
      e.grade = grade;
      e.backlash_angle = 1e-3 * play, e.angle_lower = 0.9e-3 * play, e.angle_upper = 1.1e-3 * play;
      e.rig_digest = "0";
      file.append(e);
    }
  }

  void change(const std::string& joint, double hour, diagnosis::ChangeState state) {
    diagnosis::KnownChange c;
    c.id = 1;
    c.state = state;
    c.found.effect = "backlash";
    c.found.since = kNoon + hour * kHour;
    c.found.since_from = c.found.since - 60, c.found.since_to = c.found.since + 60;
    c.found.size = {{"angle", "rad", 2e-4, 1e-5}};
    c.seen = c.found.since + 600;
    diagnosis::append_change(path("history/" + joint + "_changes.csv"), c);
  }

  Json day(int code, const std::string& more = "--until 2027-01-01T12:00:00Z") {
    const Outcome outcome = run("day_report history --out day.html --json day.json " + more);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    return Json::parse(read("day.json"));
  }

  void SetUp() override {
    CommandTest::SetUp();
    shell("mkdir history");
  }
};

TEST_F(DayReport, ADayWithoutAChangeIsReportedAsSuch) {
  history("elbow", "good", 0.5);
  const Json page = day(0);
  EXPECT_EQ(page["to"], kNoon);
  EXPECT_EQ(page["joints"].size(), 1u);
  const Json& elbow = page["joints"][0];
  EXPECT_EQ(elbow["joint"], "elbow");
  EXPECT_EQ(elbow["told"], 25);  // of the last day alone, both ends among them
  EXPECT_EQ(elbow["series"][0]["time"], kNoon - 24 * kHour);
  EXPECT_DOUBLE_EQ(elbow["series"][0]["backlash_angle"], 0.5e-3);
  expect_contains(read("day.html"), "0.5 [0.45, 0.55] mrad");
  EXPECT_EQ(day(0, "--hours 2 --until 2027-01-01T06:30:00Z")["joints"][0]["told"], 2);
}

TEST_F(DayReport, ChangesOfTheDayAreReported) {
  history("elbow", "good", 0.5);
  history("wrist", "watch", 0.8);
  EXPECT_EQ(day(1)["joints"].size(), 2u);
  change("wrist", -5, diagnosis::ChangeState::standing);
  change("elbow", -6, diagnosis::ChangeState::withdrawn);
  const Json page = day(2);
  EXPECT_TRUE(page["joints"][0]["changes"].empty());
  EXPECT_EQ(page["joints"][1]["changes"][0]["since"], kNoon - 5 * kHour);
  expect_contains(page["summary"].get<std::string>(), "wrist: backlash since 2027-01-01T07:00:00Z");
  expect_contains(read("day.html"), "backlash since 2027-01-01T07:00:00Z");
  expect_contains(read("day.html"), "<b>Changed, watch: wrist. Good: elbow.</b>");
  // It began after that day.
  EXPECT_EQ(day(1, "--until 2027-01-01T06:00:00Z")["joints"][1]["changes"].size(), 0u);
}

TEST_F(DayReport, AJointWithoutAnAnswerIsCounted) {
  history("elbow", "cannot_tell", std::nan(""));
  const Json page = day(3);
  EXPECT_EQ(page["joints"][0]["told"], 0);
  expect_contains(page["summary"].get<std::string>(), "of 1 no estimate states the play");
}

/// A folder that nobody writes any more is not reported as today's.
TEST_F(DayReport, SinceWhenNothingWasReported) {
  const double now = double(std::time(nullptr));
  history("elbow", "good", 0.5, now - 5 * kHour);
  const Json all = day(3, "");
  EXPECT_NEAR(all["joints"][0]["silent_since"].get<double>(), now - 5 * kHour, 1e-3);
  const std::string text = "nothing since " + utc_time(now - 5 * kHour) + " (5.0 h): no diagnoser wrote";
  expect_contains(all["summary"].get<std::string>(), text);
  expect_contains(read("day.html"), text);
  expect_contains(read("day.html"), "<p class=\"verdict cannot_tell\"><b>Good, silent: elbow.</b>");
  history("wrist", "good", 0.5, now);
  const Json one = day(0, "");
  expect_contains(one["joints"][0]["silence"].get<std::string>(), "no sample of this joint");
  EXPECT_TRUE(one["joints"][1]["silent_since"].is_null());
  // The same day, asked for by its end, ends there.
  EXPECT_TRUE(day(0, "--until " + utc_time(now - 5 * kHour))["joints"][0]["silent_since"].is_null());
}

TEST_F(DayReport, WrongFoldersAndTimesAreRefused) {
  EXPECT_EQ(run("day_report nowhere --out day.html").code, 66);
  EXPECT_EQ(run("day_report history --out day.html").code, 65);
  write("history/elbow.csv", "time,value\n1,2\n");
  const Outcome wrong = run("day_report history --out day.html");
  EXPECT_EQ(wrong.code, 65);
  expect_contains(wrong.err, "elbow.csv");
  shell("rm history/elbow.csv");
  history("elbow", "good", 0.5);
  EXPECT_EQ(run("day_report history --out day.html --until yesterday").code, 64);
  EXPECT_EQ(run("day_report history --out day.html --hours -1").code, 64);
  EXPECT_FALSE(exists("day.html"));
}

}  // namespace
}  // namespace backlash::test
