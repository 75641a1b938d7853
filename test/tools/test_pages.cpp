// SPDX-License-Identifier: BSD-3-Clause
// The pages of diagnose_record and trace_residual: what is in them, and in a real browser what is to be seen.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

const std::string kFolderWithGaps = "it's <b> & \"co\"";  // a name that HTML and shells could misread

class Pages : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    write("rig.yaml", content(package_file("config/sarkar_1997.yaml")) + "# <script>alert(1)</script>\n");
  }

  void record(const std::string& out) {
    done("simulate rig.yaml --duration 1.5 --sample-rate 2000 --backlash 80e-6 --seed 3 --out " + out);
  }

  /// A curve of few points: the tests look at pages, not at how good an estimate is.
  void curve() { done("build_curve rig.yaml --out curve.yaml --sample-rate 2000 --points 9 --periods 4"); }

  /// What a browser shows of each page; null, with the test marked as skipped, where there is none.
  Json looked_at(const std::string& pages) {
    const Outcome outcome =
        shell("/usr/bin/python3 '" + package_file("test/tools/look_at_pages.py") + "' " + pages);
    EXPECT_TRUE(outcome.code == 0 || outcome.code == 77) << outcome.err;
    return outcome.code == 0 ? Json::parse(outcome.out) : Json{{"skipped", outcome.err}};
  }
};

const std::string kDiagnose =
    "diagnose_record run.csv --rig rig.yaml --curve curve.yaml --json out.json --report out.html";

/// The first table whose head has these words in its first cells.
Json table_with(const Json& page, const std::vector<std::string>& heads) {
  for (const Json& table : page.at("tables")) {
    if (table.empty() || table[0].size() < heads.size()) continue;
    if (std::equal(heads.begin(), heads.end(), table[0].begin())) return table;
  }
  ADD_FAILURE() << "no table " << heads.front() << "\n" << page.at("tables").dump(1);
  return Json::array();
}

/// "80.0\n[78.2, 81.9]" -> the three numbers.
std::vector<double> numbers(const std::string& cell) {
  std::vector<double> found;
  const std::regex number(R"([-+]?\d+(\.\d+)?(e[-+]?\d+)?)");
  for (std::sregex_iterator i(cell.begin(), cell.end(), number), end; i != end; ++i)
    found.push_back(std::stod(i->str()));
  return found;
}

/// Value and interval as in the JSON, in another unit. `digits` are shown: half of the last one is lost.
void expect_numbers(const std::string& cell, const Json& value, const Json& interval, double unit,
                    int digits = 4) {
  const std::vector<double> shown = numbers(cell);
  if (value.is_null() && interval.is_null()) {
    EXPECT_TRUE(shown.empty()) << cell;
    return;
  }
  std::vector<double> given = {value.get<double>()};
  for (const Json& end : interval)
    if (end.is_number()) given.push_back(end.get<double>());
  ASSERT_EQ(shown.size(), given.size()) << cell;
  for (std::size_t i = 0; i < given.size(); ++i)
    EXPECT_NEAR(shown[i], given[i] / unit, 5.01 * std::pow(10, -digits) * std::fabs(given[i] / unit)) << cell;
}

void expect_drawn(const Json& page, std::size_t plots) {
  EXPECT_EQ(page.at("plots").size(), plots);
  for (const Json& plot : page.at("plots")) {
    EXPECT_GT(plot.at("width"), 100) << plot;
    EXPECT_GT(plot.at("shown")[0], 100) << plot;
    EXPECT_GT(plot.at("colours"), 10) << plot;
    EXPECT_LT(plot.at("background"), 0.995) << plot;
    EXPECT_GT(plot.at("coloured"), 0.001) << plot;  // a curve of 1 px across half of the width has more
    EXPECT_GT(plot.at("background"), 0.3) << plot;
  }
}

/// No errors, nothing loaded but the page itself, nothing wider than the window.
void expect_sound(const Json& page) {
  EXPECT_EQ(page.at("console"), Json::array());
  ASSERT_EQ(page.at("requests").size(), 1u) << page.at("requests");
  EXPECT_EQ(page.at("requests")[0].get<std::string>().rfind("file://", 0), 0u);
  for (const Json& pixels : page.at("too_wide")) EXPECT_EQ(pixels, 0) << page.at("too_wide");
}

TEST_F(Pages, ADiagnosisInABrowser) {
  record("run.csv");
  curve();
  const Outcome diagnosis = run(kDiagnose);
  ASSERT_LE(diagnosis.code, 2) << diagnosis.err;
  const Json seen = looked_at("out.html");
  if (seen.contains("skipped")) GTEST_SKIP() << seen["skipped"].get<std::string>();
  const Json& page = seen.at(0);
  const Json json = Json::parse(read("out.json"));
  expect_sound(page);
  expect_drawn(page, 8);  // intervals, curve, APD, loop, torque, position; fitted torque and position
  const Json table = table_with(page, {"method", "status"});
  const Json& estimates = json.at("estimates");
  ASSERT_EQ(table.size(), estimates.size() + 2);  // heads, and all together
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const Json &row = table[i + 1], &e = estimates[i];
    EXPECT_EQ(row[0], e.at("method"));
    std::string status = e.at("status");
    std::replace(status.begin(), status.end(), '_', ' ');
    EXPECT_EQ(row[1], status);
    expect_numbers(row[2], e.at("backlash"), e.at("interval"), 1e-6);
  }
  const Json& verdict = json.at("verdict");
  expect_numbers(table.back()[2], verdict.at("backlash"), verdict.at("interval"), 1e-6);
  const Json machine = table_with(page, {"value", "declared", "known within", "this record says"});
  ASSERT_GT(machine.size(), 20u);
  EXPECT_EQ(machine[3][0], "motor.viscous_damping");
  EXPECT_EQ(machine[3][1], "0.0048 N m s/rad");
  EXPECT_EQ(machine[3][2], "50 %, by default");
  EXPECT_NEAR(numbers(machine[3][3]).at(0), 0.0048, 0.0001);  // what was simulated, to two per cent
  const std::string text = page.at("text"), said = verdict.at("message");
  for (const std::string& part : std::vector<std::string>{
           said.substr(said.find(" by ") + 3), "2000 Hz", "The fitted machine over the record",
           "# <script>alert(1)</script>", "SUNDIALS", json.at("version"), "run.csv", "matplotlib"})
    expect_contains(text, part);
}

TEST_F(Pages, TheCommandOnAPageGivesTheSameAgain) {
  std::filesystem::create_directory(path(kFolderWithGaps));
  record("run.bag");
  curve();
  std::filesystem::rename(path("run.bag"), path(kFolderWithGaps + "/run.bag"));
  const std::string quoted = R"("it's <b> & \"co\"/run.bag")";
  const std::string line = "diagnose_record " + quoted + " --rig rig.yaml --curve curve.yaml --json out.json";
  ASSERT_LE(run(line + " --report out.html").code, 2);
  const std::string page = read("out.html"), first = read("out.json");
  std::smatch found;
  ASSERT_TRUE(std::regex_search(page, found, std::regex("<pre id=\"command\"[^>]*>([^]*?)</pre>")));
  std::string command = found[1];
  for (const auto& [written, meant] : std::vector<std::pair<std::string, std::string>>{
           {"&lt;", "<"},
           {"&gt;", ">"},
           {"&quot;", "\""},
           {"&amp;", "&"},
           {"rosrun backlash_diagnosis ", "'" BACKLASH_DIAGNOSIS_BIN_DIR "'/"}})
    for (std::size_t at = 0; (at = command.find(written, at)) != std::string::npos; at += meant.size())
      command.replace(at, written.size(), meant);
  std::filesystem::remove(path("out.json"));
  std::filesystem::remove(path("out.html"));
  write("again.sh", command + "\n");
  EXPECT_LE(shell("cd / && bash '" + path("again.sh") + "'").code, 2);
  EXPECT_EQ(read("out.json"), first);
  EXPECT_EQ(read("out.html"), page);
  EXPECT_EQ(page.find("it's <b>"), std::string::npos);
}

TEST_F(Pages, AreWrittenWholeOrNotAtAll) {
  record("run.csv");
  const std::string line =
      "diagnose_record run.csv --rig rig.yaml --method lost_motion --json out.json --report ";
  EXPECT_EQ(run(line + "missing/out.html").code, 73);
  EXPECT_FALSE(exists("out.json"));  // refused before any work
  EXPECT_EQ(run(line + "out.json").code, 64);
  EXPECT_EQ(run(line + "run.csv").code, 64);
  write("out.html", "the old page");
  // A limit on the size of files, larger than the JSON and smaller than the page, stands for a full disk.
  const Outcome full = run(line + "out.html", "ulimit -f 12; trap '' XFSZ;");
  EXPECT_EQ(full.code, 73) << full.err;
  EXPECT_TRUE(exists("out.json"));
  EXPECT_EQ(read("out.html"), "the old page");
  for (const auto& entry : std::filesystem::directory_iterator(path("")))
    EXPECT_EQ(entry.path().string().find(".tmp-"), std::string::npos) << entry.path();
}

TEST_F(Pages, SayWhyThereAreNoPlots) {
  record("run.csv");
  const Outcome outcome =
      run("diagnose_record run.csv --rig rig.yaml --method lost_motion --json out.json --report out.html",
          "TMPDIR=/nonexistent");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  expect_contains(read("out.html"), "No plots were drawn: no folder for temporary files");
  expect_contains(read("out.html"), "lost_motion");
}

TEST_F(Pages, AMachineWithAnglesOnlyAndALinearAxisHavePages) {
  for (const std::string rig : {"cycloidal", "two_inertia_servo", "emps"}) {
    std::filesystem::copy(package_file("config/" + rig + ".yaml"), path(rig + ".yaml"));
    done("simulate " + rig + ".yaml --duration 4 --out " + rig + ".csv");
    const Outcome outcome = run("diagnose_record " + rig + ".csv --rig " + rig +
                                ".yaml --json out.json --report " + rig + ".html");
    EXPECT_LE(outcome.code, 3) << outcome.err;
    const std::string page = read(rig + ".html");
    expect_contains(page, "data:image/png;base64,");
    EXPECT_EQ(page.find("No plots were drawn"), std::string::npos) << rig;
    EXPECT_EQ(page.find(">nan<"), std::string::npos);
  }
}

TEST_F(Pages, ATraceInABrowser) {
  write("emps.yaml", content(package_file("config/emps.yaml")));
  const std::string shaking =
      "excitation:\n  type: random\n  rms: 40\n  lower_frequency: 0.15\n  upper_frequency: 3\n  lines: 60\n  "
      "seed: ";
  for (const auto& [name, seed] :
       std::vector<std::pair<std::string, std::string>>{{"train", "1"}, {"test", "2"}}) {
    write("machine.yaml",
          std::regex_replace(read("emps.yaml"), std::regex("excitation:\n(  .*\n)+"), shaking + seed + "\n") +
              "\nterms:\n  - id: asymmetric_viscous\n    body: motor\n    damping: 30\n");
    done("simulate machine.yaml --seed " + seed + " --duration 12 --sample-rate 250 --out " + name + ".csv");
  }
  done("trace_residual --rig emps.yaml --train train.csv --test test.csv --out out");
  const Json seen = looked_at("out/report.html");
  if (seen.contains("skipped")) GTEST_SKIP() << seen["skipped"].get<std::string>();
  const Json& page = seen.at(0);
  const Json json = Json::parse(read("out/report.json"));
  expect_sound(page);
  expect_drawn(page, 5);  // residual over time, speed, position, order; what the effect adds
  const std::string text = page.at("text");
  for (const std::string& part :
       std::vector<std::string>{json.at("message"), "asymmetric_viscous", "SUNDIALS", "matplotlib",
                                json.at("version"), "schema_version: 1"})
    expect_contains(text, part);
  const Json& torque = json.at("channels").at("torque");
  const Json& rows = page.at("tables")[0];
  for (const auto& [row, key] :
       std::vector<std::pair<int, std::string>>{{0, "before"}, {1, "after"}, {2, "floor"}})
    expect_numbers(rows[row].back(), torque.at(key), Json::array(), 0.01, 3);
  const std::string command = page.at("command");
  expect_contains(command, "trace_residual --rig emps.yaml --train train.csv --test test.csv --cutoff ");
  expect_contains(command, " --out out");
}

}  // namespace
}  // namespace backlash::test
