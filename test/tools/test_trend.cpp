// SPDX-License-Identifier: BSD-3-Clause
// The command backlash_trend: exit codes, JSON, limits of rigs and baselines, refusals.
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/history.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDay = 86400, kStart = 1798761600;  // 2027-01-01
const std::string kRig = package_file("config/sarkar_1997.yaml");

class TrendCommand : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::filesystem::create_symlink(kRig, path("rig.yaml"));
    digest_ = rig_file::load_rig_file(kRig).digest;
  }

  /// A point per day from 100 um on; scatter 0.5 um.
  void write_history(int days, double um_per_day, const std::string& name = "elbow.csv") const {
    Random random(1);
    diagnosis::History history({path(name)});
    for (int i = 0; i < days; ++i) {
      diagnosis::HistoryEntry e;
      e.time = kStart + kDay * i;
      e.grade = "good";
      e.backlash = 1e-6 * (100 + um_per_day * i + 0.5 * random.normal());
      e.lower = e.backlash - 1e-6;
      e.upper = e.backlash + 1e-6;
      e.backlash_angle = 50 * e.backlash;
      e.methods = "lost_motion";
      e.rig_digest = digest_;
      history.append(e);
    }
  }

  Json report(const std::string& arguments, int code) const {
    const Outcome outcome = run("backlash_trend " + arguments + " --json -");
    EXPECT_EQ(outcome.code, code) << arguments << "\n" << outcome.err << outcome.out;
    return Json::parse(outcome.out);
  }

  std::string digest_;
};

TEST_F(TrendCommand, ExitCodesSayHowFarTheLimitIs) {
  write_history(40, 0.5);  // 119.5 um at its end: 150 um after 61 days more
  EXPECT_EQ(run("backlash_trend elbow.csv --limit 150e-6").code, 1);
  EXPECT_EQ(run("backlash_trend elbow.csv --limit 150e-6 --horizon 70").code, 1);
  EXPECT_EQ(run("backlash_trend elbow.csv --limit 150e-6 --horizon 50").code, 0);
  EXPECT_EQ(run("backlash_trend elbow.csv --limit 190e-6").code, 0);
  EXPECT_EQ(run("backlash_trend elbow.csv --limit 110e-6").code, 2);
  EXPECT_EQ(run("backlash_trend elbow.csv").code, 0);  // it grows, but no limit is given
  write_history(40, 0, "still.csv");
  EXPECT_EQ(run("backlash_trend still.csv --limit 101e-6").code, 0);
  EXPECT_EQ(run("backlash_trend still.csv --limit 99e-6").code, 2);
  write_history(5, 0.5, "short.csv");
  const Outcome outcome = run("backlash_trend short.csv --limit 150e-6");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.out, "no trend: 5 points at different times, at least 10 are needed\n");
}

TEST_F(TrendCommand, JsonHasTheDocumentedKeys) {
  write_history(40, 0.5);
  const Json json = report("elbow.csv --limit 150e-6", 1);
  std::vector<std::string> keys;
  for (const auto& item : json.items()) keys.push_back(item.key());
  EXPECT_EQ(keys, (std::vector<std::string>{
                      "schema_version", "version",       "history",      "rig",      "rig_digest",
                      "quantity",       "unit",          "limit",        "horizon",  "entries",
                      "points",         "span",          "known",        "grows",    "exceeded",
                      "rate",           "rate_interval", "level",        "time",     "date",
                      "reaches",        "message",       "silent_since", "warnings", "series"}));
  EXPECT_EQ(json["schema_version"], 1);
  EXPECT_EQ(json["points"], 40);
  // Four standard errors of a slope by least squares: 0.5 um sqrt(12) / (40^1.5 days) = 0.007 um per day.
  EXPECT_NEAR(json["rate"].get<double>() * kDay, 0.5e-6, 4 * 0.007e-6);
  EXPECT_LE(json["rate_interval"][0], json["rate"]);
  EXPECT_GE(json["rate_interval"][1], json["rate"]);
  EXPECT_NEAR(json["reaches"]["time"].get<double>(), kStart + 100 * kDay, 4 * kDay);
  EXPECT_LE(json["reaches"]["interval"][0], json["reaches"]["time"]);
  EXPECT_GE(json["reaches"]["interval"][1], json["reaches"]["time"]);
  EXPECT_TRUE(std::regex_match(json["reaches"]["date"].get<std::string>(),
                               std::regex("2027-04-[01][0-9]T[0-9:]{8}Z")));
  EXPECT_EQ(json["date"], "2027-02-09T00:00:00Z");
  EXPECT_EQ(json["series"]["time"].size(), 40u);
  EXPECT_EQ(json["series"]["interval"][0].size(), 2u);
  const Json angle = report("elbow.csv --limit-angle 7.5e-3", 1);
  EXPECT_EQ(angle["unit"], "rad");
  EXPECT_NEAR(angle["rate"].get<double>() / json["rate"].get<double>(), 50, 1e-9);
  EXPECT_TRUE(angle["series"]["interval"][0].is_null());
}

TEST_F(TrendCommand, LimitsComeFromRigFileOrBaseline) {
  write_history(40, 0.5);
  const double service = rig_file::load_rig_file(kRig).diagnosis.limits->service;
  const Json by_rig = report("elbow.csv --rig rig.yaml", 1);
  EXPECT_EQ(by_rig["limit"], service);
  EXPECT_EQ(by_rig["rig"], "sarkar_1997");
  write("limits.yaml", "schema_version: 1\nbacklash: {watch: 1e-4, service: 3e-4, stop: 4e-4}\n");
  EXPECT_EQ(report("elbow.csv --rig rig.yaml --limits limits.yaml", 0)["limit"], 3e-4);
  write("healthy.yaml", "schema_version: 1\nrig: sarkar_1997\nrig_digest: \"" + digest_ +
                            "\"\nmethods: [lost_motion]\nbacklash: 9e-5\ninterval: [8e-5, 1e-4]\n"
                            "backlash_angle: 4e-3\nangle_interval: [3e-3, 5e-3]\n");
  const Json grown = report("elbow.csv --rig rig.yaml --baseline healthy.yaml", 0);
  EXPECT_DOUBLE_EQ(grown["limit"], 9e-5 + service);
  EXPECT_TRUE(grown["warnings"].empty());
  write("edited.yaml", read("rig.yaml") + "# a remark\n");
  const Json other = report("elbow.csv --rig edited.yaml --baseline healthy.yaml", 3);
  EXPECT_EQ(other["points"], 0);
  expect_contains(other["warnings"].dump(), "40 entries were made with another version of the rig file");
  expect_contains(other["warnings"].dump(), "taken with another version of the rig file");
}

TEST_F(TrendCommand, DrawsWhatItReports) {
  write_history(40, 0.5);
  run("backlash_trend elbow.csv --limit 150e-6 --json t.json --plot t.png");
  EXPECT_EQ(read("t.png").substr(1, 3), "PNG");
  write_history(3, 0, "short.csv");
  EXPECT_EQ(run("backlash_trend short.csv --plot s.svg").code, 3);  // the JSON is optional
  expect_contains(read("s.svg"), "<svg");
}

TEST_F(TrendCommand, RefusalsNameTheirReason) {
  write_history(3, 0.5);
  write("foreign.csv", "time,motor_torque\n0,1\n");
  for (const auto& [arguments, code] :
       std::vector<std::pair<std::string, int>>{{"", 64},
                                                {"elbow.csv --limit 1e-4 --limit-angle 1e-3", 64},
                                                {"elbow.csv --limit -1", 64},
                                                {"elbow.csv --horizon 0", 64},
                                                {"elbow.csv --limit 1e-4 --limits limits.yaml", 64},
                                                {"elbow.csv --baseline healthy.yaml", 64},
                                                {"elbow.csv --json elbow.csv", 64},
                                                {"elbow.csv --json t.json --plot t.txt", 64},
                                                {"foreign.csv", 65},
                                                {"elbow.csv --rig foreign.csv", 65},
                                                {"nowhere.csv", 66},
                                                {"elbow.csv --limits nowhere.yaml", 66},
                                                {"elbow.csv --json nowhere/t.json", 73}}) {
    const Outcome outcome = run("backlash_trend " + arguments);
    EXPECT_EQ(outcome.code, code) << arguments << "\n" << outcome.err;
    expect_contains(outcome.err, "backlash_trend: ");
  }
  // What damage left out is reported, and does not stop the rest.
  write("elbow.csv", read("elbow.csv") + "1798761600,,estim");
  expect_contains(run("backlash_trend elbow.csv").err, "elbow.csv:5: has 3 of 13 cells; left out");
}

}  // namespace
}  // namespace backlash::test
