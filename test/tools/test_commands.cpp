// SPDX-License-Identifier: BSD-3-Clause
// The commands as their users run them: exit codes, files, messages.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

const std::string kRig = package_file("config/sarkar_1997.yaml");

/// The rig with noise on its torque sensor, and with 50 instead of 10 Hz: five times as many periods per
/// second.
std::string rig_variant(bool noise, bool fast) {
  std::string text;
  {
    std::ifstream in(kRig);
    text.assign(std::istreambuf_iterator<char>(in), {});
  }
  const auto replace = [&text](const std::string& pattern, const std::string& by) {
    const std::string changed =
        std::regex_replace(text, std::regex(pattern), by, std::regex_constants::format_first_only);
    EXPECT_NE(changed, text) << pattern;
    text = changed;
  };
  if (noise) replace("\nsensors:\n", "\nsensors:\n  sensor_torque: {noise: 0.002}\n");
  if (fast) replace("frequency: 10 ", "frequency: 20 ");
  if (fast) replace("period: 0\\.1 ", "period: 0.05 ");
  return text;
}

class Commands : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::filesystem::create_symlink(kRig, path("rig.yaml"));
  }

  /// Runs diagnose_record with the report on standard output.
  Json report(const std::string& arguments, int expected_code) {
    const Outcome outcome = run("diagnose_record " + arguments + " --json -");
    EXPECT_EQ(outcome.code, expected_code) << arguments << "\n" << outcome.err << outcome.out;
    return Json::parse(outcome.out);
  }
};

TEST_F(Commands, HelpAndVersion) {
  for (const std::string& command : std::vector<std::string>{
           "simulate", "backlash_trend", "build_curve", "compare_models", "diagnose_record", "convert_record",
           "export_model", "gear_geometry", "identify", "integrator_study", "search_parameters",
           "separability_map", "trace_residual", "uncertainty_study"}) {
    const std::string help = done(command + " --help").out;
    expect_contains(help, "Usage: " + command);
    for (const char* part : {"Options:", "rosrun", "Exit codes"}) expect_contains(help, part);
    EXPECT_EQ(done(command + " --whatever --help").out, help);
    EXPECT_TRUE(std::regex_search(done(command + " --version").out, std::regex("[0-9]+\\.[0-9]+\\.[0-9]+")));
  }
}

TEST_F(Commands, UsageErrorsEndWith64AndPointToHelp) {
  write("a.csv", "time,motor_torque\n0,1\n1,2\n");
  const std::string curve = "build_curve rig.yaml --out c.yaml ";
  for (const std::string& line : std::vector<std::string>{
           "simulate",
           "simulate rig.yaml --out x.csv",
           "simulate rig.yaml --duration 1",
           "simulate rig.yaml --duration 0 --out x.csv",
           "simulate rig.yaml --duration 1s --out x.csv",
           "simulate rig.yaml --duration 1 --out x.txt",
           "simulate rig.yaml --duration 1e-9 --out x.csv",
           "simulate rig.yaml --duration 1e9 --out x.csv",
           "simulate rig.yaml --duration 1 --out x.csv --backlash -1e-6",
           "simulate rig.yaml --duration 1 --out x.csv --backlash 1e-6 --half-gap 1e-6",
           "simulate rig.yaml --duration 1 --out x.csv --seed 1.5",
           "simulate rig.yaml --duration 1 --out x.csv --sample-rate 0",
           "simulate rig.yaml --duration 1 --out x.csv --wrong 1",
           "simulate rig.yaml --run walk --out x.csv",
           "simulate rig.yaml --run walk",
           "simulate rig.yaml --list-runs --out x.csv",
           "simulate rig.yaml --list-runs=1",
           "simulate rig.yaml rig.yaml --duration 1 --out x.csv",
           "build_curve rig.yaml",
           curve + "--points 1",
           curve + "--max-backlash 0",
           curve + "--periods 0",
           curve + "--seeds none",
           curve + "--plot c.txt",
           "build_curve rig.yaml --out rig.yaml",
           "diagnose_record --json -",
           "diagnose_record a.txt --json -",
           "diagnose_record a.csv --json a.csv",
           "diagnose_record a.csv --json - --method guess",
           "diagnose_record a.csv --json - --periods 0",
           "convert_record a.csv",
           "convert_record a.csv ./a.csv",
           "convert_record a.csv a.csv.gz",
           "convert_record a.csv b.bag c.bag",
       }) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, 64) << line << "\n" << outcome.err;
    expect_contains(outcome.err, "see --help");
    EXPECT_EQ(outcome.out, "") << line;
  }
  EXPECT_EQ(files(), 2u);
  EXPECT_EQ(read("a.csv"), "time,motor_torque\n0,1\n1,2\n");
}

TEST_F(Commands, SimulateKnowsTheTestRunsOfARig) {
  for (const char* name : {"yumrukcal_2013.yaml", "yumrukcal_2013_runs.yaml"})
    std::filesystem::create_symlink(package_file(std::string("config/") + name), path(name));
  const std::string servo = "simulate yumrukcal_2013.yaml ";
  const std::string list = done(servo + "--list-runs").out;
  expect_contains(list, "external_excitation: 40 s, multi_sine at the load, motor braked\n");
  expect_contains(list, "motor_inertia_sine: 30 s, sine_speed, driver alone\n");
  EXPECT_EQ(std::count(list.begin(), list.end(), '\n'), 12);
  EXPECT_EQ(done("simulate rig.yaml --list-runs").out, "");
  const std::string square = servo + "--run square_wave --sample-rate 50 --out a.csv";
  expect_contains(done(square).out, "1000 samples at 50 Hz of yumrukcal_2013, run square_wave,");  // 20 s
  expect_contains(done(square + " --duration 1").out, ": 50 samples");
  const Outcome unknown = run(servo + "--run walk --out b.csv");
  EXPECT_EQ(unknown.code, 64);
  expect_contains(unknown.err, "--run = 'walk': must be one of external_excitation, sine_sweep,");
  expect_contains(run("simulate rig.yaml --run walk --out b.csv").err, "has no test_runs");
  EXPECT_FALSE(exists("b.csv"));
}

TEST_F(Commands, MissingInputEndsWith66) {
  write("a.csv", "time,motor_torque\n0,1\n1,2\n");
  for (const std::string& line : std::vector<std::string>{
           "simulate none.yaml --duration 1 --out x.csv", "build_curve none.yaml --out x.yaml",
           "diagnose_record none.csv --json x.json", "diagnose_record none.bag --json x.json",
           "diagnose_record a.csv --rig none.yaml --json x.json",
           "diagnose_record a.csv --curve none.yaml --json x.json", "convert_record none.csv x.bag",
           "convert_record none.bag x.csv", "convert_record a.csv x.bag --rig none.yaml"}) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, 66) << line;
    expect_contains(outcome.err, "none.");
  }
  EXPECT_EQ(files(), 2u);
}

TEST_F(Commands, BadDataEndsWith65AndNamesTheFile) {
  write("bad.csv", "time,motor_torque\n0,1\n1,abc\n");
  write("text.bag", "time,motor_torque\n0,1\n1,2\n");
  write("empty.bag", "");
  write("bad.yaml", "schema_version: 1\nname: 3\n");
  write("a.csv", "time,motor_torque\n0,1\n1,2\n");
  done("convert_record a.csv whole.bag");
  std::string bytes = read("whole.bag");
  write("truncated.bag", bytes.substr(0, bytes.size() / 2));
  const auto chunk = bytes.find("\x04\"M\x18");  // magic number of an lz4 frame: the packed chunk
  ASSERT_NE(chunk, std::string::npos);
  bytes[chunk + 40] ^= 0x10;
  write("flipped.bag", bytes);
  for (const std::string& name :
       std::vector<std::string>{"bad.csv", "text.bag", "empty.bag", "truncated.bag", "flipped.bag"}) {
    const std::string out = name.find(".csv") == std::string::npos ? "x.csv" : "x.bag";
    for (const std::string& line :
         {"convert_record " + name + " " + out, "diagnose_record " + name + " --json x.json"}) {
      const Outcome outcome = run(line);
      EXPECT_EQ(outcome.code, 65) << line;
      expect_contains(outcome.err, name);
    }
  }
  EXPECT_EQ(run("simulate bad.yaml --duration 1 --out x.csv").code, 65);
  EXPECT_EQ(run("diagnose_record a.csv --curve bad.yaml --json x.json").code, 65);
  EXPECT_EQ(run("convert_record whole.bag x.csv --joint other").code, 65);
  for (const char* name : {"x.csv", "x.bag", "x.json"}) EXPECT_FALSE(exists(name)) << name;
}

TEST_F(Commands, UnwritableOutputEndsWith73) {
  write("a.csv", "time,motor_torque\n0,1\n1,2\n");
  std::filesystem::create_directory(path("folder.csv"));
  for (const std::string& line : std::vector<std::string>{
           "simulate rig.yaml --duration 0.1 --out none/x.csv",
           "simulate rig.yaml --duration 0.1 --out folder.csv",
           "simulate rig.yaml --duration 0.1 --out none/x.bag",
           "build_curve rig.yaml --points 2 --out none/x.yaml",
           "build_curve rig.yaml --points 2 --out x.yaml --plot none/x.png",
           "diagnose_record a.csv --json none/x.json", "convert_record a.csv none/x.bag",
           "convert_record a.csv none/x.csv", "diagnose_record a.csv --json /dev/full"}) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, 73) << line << "\n" << outcome.err;
    expect_contains(outcome.err, "cannot be written");
  }
  EXPECT_EQ(files(), 3u);
}

// A limit on the size of files stands for a disk that is full halfway.
TEST_F(Commands, DiskThatFillsUpLeavesNothing) {
  done("simulate rig.yaml --duration 2 --out a.csv");
  for (const std::string& line :
       std::vector<std::string>{"convert_record a.csv x.bag", "convert_record a.csv x.csv",
                                "simulate rig.yaml --duration 2 --out x.bag"})
    EXPECT_EQ(run(line, "trap '' XFSZ; ulimit -f 20;").code, 73) << line;
  EXPECT_EQ(files(), 2u);
}

TEST_F(Commands, SimulateIsDeterministicForASeed) {
  write("noisy.yaml", rig_variant(true, false));
  const std::string start = "simulate noisy.yaml --duration 0.2 --backlash 6e-5 ";
  done(start + "--seed 5 --out a.csv");
  done(start + "--seed 5 --out b.csv");
  done(start + "--seed 6 --out c.csv");
  EXPECT_EQ(read("a.csv"), read("b.csv"));
  EXPECT_NE(read("a.csv"), read("c.csv"));
  done("simulate rig.yaml --duration 0.2 --backlash 6e-5 --seed 5 --out d.csv");
  done("simulate rig.yaml --duration 0.2 --half-gap 3e-5 --seed 6 --out e.csv");
  EXPECT_EQ(read("d.csv"),
            read("e.csv"));  // no noise, so no seed; half a gap of 30 um is a backlash of 60 um
  EXPECT_NE(read("a.csv"), read("d.csv"));
}

TEST_F(Commands, SimulateObeysDurationRateAndBacklash) {
  done("simulate rig.yaml --duration 0.05 --sample-rate 2000 --out a.csv");
  const std::string text = read("a.csv");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 101);  // 0.05 s at 2 kHz and the column names
  EXPECT_EQ(text.substr(0, 5), "time,");
  EXPECT_NE(text.find("\n0.0005,"), std::string::npos);
  done("simulate rig.yaml --duration 0.05 --sample-rate 2000 --backlash 1e-4 --out b.csv");
  EXPECT_NE(text, read("b.csv"));
}

TEST_F(Commands, CsvToBagToCsvIsTheSameFile) {
  write("noisy.yaml", rig_variant(true, false));
  done("simulate noisy.yaml --duration 0.5 --backlash 6e-5 --out a.csv");
  done("convert_record a.csv a.bag --joint elbow");
  done("convert_record a.bag b.csv");
  EXPECT_EQ(read("a.csv"), read("b.csv"));
  done("simulate noisy.yaml --duration 0.5 --backlash 6e-5 --out c.bag");
  done("convert_record c.bag c.csv --rig rig.yaml");
  EXPECT_EQ(read("a.csv"), read("c.csv"));
  EXPECT_EQ(run("convert_record a.bag d.csv --rig rig.yaml").code, 65);  // the rig's joint is not 'elbow'
  done("convert_record a.bag d.csv --rig rig.yaml --joint elbow");
  EXPECT_EQ(read("a.csv"), read("d.csv"));
}

TEST_F(Commands, PartsOfARecordPutTogetherAreTheRecord) {
  done("simulate rig.yaml --duration 0.5 --out a.csv");
  done("convert_record a.csv first.csv --to 0.2");
  done("convert_record a.csv last.bag --from 0.2 --rig rig.yaml");
  done("convert_record last.bag last.csv --rig rig.yaml");
  const std::string last = read("last.csv");
  EXPECT_EQ(read("a.csv"), read("first.csv") + last.substr(last.find('\n') + 1));
  EXPECT_EQ(run("convert_record a.csv x.csv --from 0.3 --to 0.3").code, 64);
  const Outcome none = run("convert_record a.csv x.csv --from 7");
  EXPECT_EQ(none.code, 65);
  expect_contains(none.err, "a.csv: has no sample from 7 s on");
}

// For programs that start a command: lines instead of a summary, and the same curve.
TEST_F(Commands, FeedbackIsAnObjectALine) {
  done("build_curve rig.yaml --points 3 --seeds 1 --periods 1 --out a.yaml");
  std::istringstream lines(
      done("build_curve rig.yaml --points 3 --seeds 1 --periods 1 --out b.yaml --feedback").out);
  EXPECT_EQ(read("a.yaml"), read("b.yaml"));
  double last = 0;
  std::string line, best;
  while (std::getline(lines, line)) {
    const Json json = Json::parse(line);
    EXPECT_GE(json["fraction"], last);
    last = json["fraction"];
    best = json["best"];
    EXPECT_FALSE(json["phase"].get<std::string>().empty());
  }
  expect_contains(best, "3 of 3 points");
}

TEST_F(Commands, CurveOfABagIsTheCurveOfTheCsv) {
  write("noisy.yaml", rig_variant(true, false));
  done("simulate noisy.yaml --duration 1 --backlash 6e-5 --out a.csv");
  done("convert_record a.csv a.bag");
  done("convert_record a.bag a.mcap");
  done("convert_record a.mcap b.csv");
  EXPECT_EQ(read("b.csv"), read("a.csv"));
  done("build_curve noisy.yaml --points 5 --seeds 2 --periods 2 --out c.yaml");
  const std::string rest = " --rig noisy.yaml --curve c.yaml";
  Json csv = report("a.csv" + rest, 0);
  EXPECT_EQ(csv["record"], "a.csv");
  EXPECT_EQ(csv["time"], Json::array({0.0, 0.999}));
  csv.erase("record");
  csv.erase("time");
  for (const std::string name : {"a.bag", "a.mcap"}) {
    Json other = report(name + rest, 0);
    EXPECT_NEAR(other["time"][1].get<double>() - other["time"][0].get<double>(), 0.999, 1e-6);  // of 1e9 s
    other.erase("record");
    other.erase("time");
    EXPECT_EQ(csv.dump(), other.dump()) << name;
  }
}

TEST_F(Commands, ReportHasTheDocumentedShape) {
  done("simulate rig.yaml --duration 1 --backlash 6e-5 --out a.csv");
  done("build_curve rig.yaml --points 5 --seeds 2 --periods 2 --out c.yaml");
  const Json json = report("a.csv --rig rig.yaml --curve c.yaml", 0);
  std::vector<std::string> keys;
  for (const auto& item : json.items()) keys.push_back(item.key());
  EXPECT_EQ(keys, (std::vector<std::string>{"schema_version", "record", "time", "estimates", "verdict",
                                            "declared_wrong", "apd", "warnings", "rig", "rig_digest", "curve",
                                            "version", "record_check"}));
  EXPECT_EQ(json["schema_version"], 1);
  EXPECT_EQ(json["estimates"][0]["method"], "apd_skewness");
  std::vector<std::string> methods;
  for (const Json& estimate : json["estimates"]) methods.push_back(estimate["method"]);
  EXPECT_EQ(methods, diagnosis::diagnosis_methods());
  const std::size_t index = std::find(methods.begin(), methods.end(), "lost_motion") - methods.begin();
  const Json& lost_motion = json["estimates"][index];
  EXPECT_EQ(lost_motion["status"], "ok");
  // The free play that was simulated; 3 um is what the rig's own elasticity and ringing leave of it.
  EXPECT_NEAR(lost_motion["backlash"].get<double>(), 6e-5, 3e-6);
  EXPECT_LE(lost_motion["interval"][0].get<double>(), 6e-5);
  EXPECT_GE(lost_motion["interval"][1].get<double>(), 6e-5);
  // Angle at the pinion = backlash / base radius (0.014917 m in the rig file), and the reduction ratio is 1.
  EXPECT_NEAR(lost_motion["backlash_angle"].get<double>(), lost_motion["backlash"].get<double>() / 0.014917,
              1e-9);
  EXPECT_TRUE(lost_motion["skewness"].is_null());
  EXPECT_TRUE(lost_motion["components"].contains("at_torque"));
  // What has fitted the machine to the record, see verdict.h.
  EXPECT_EQ(json["verdict"]["estimate"],
            std::find(methods.begin(), methods.end(), "waveform") - methods.begin());
  EXPECT_EQ(json["apd"]["percentages"].size(), 60u);
  EXPECT_EQ(json["apd"]["periods"], 8);  // ten of 0.1 s, two of them settling
  double sum = 0;
  for (const auto& share : json["apd"]["percentages"]) sum += share.get<double>();
  EXPECT_NEAR(sum, 100, 1e-9);  // no sample outside the range; rounding of 60 sums
  EXPECT_EQ(json["rig"], "sarkar_1997");
  EXPECT_EQ(json["curve"]["source"], "c.yaml");
  EXPECT_TRUE(json["warnings"].empty());
}

TEST_F(Commands, ExitCodeFollowsTheGrade) {
  // Limits of the rig file: watch from 100 um, service from 150 um, stop from 200 um.
  const std::vector<std::pair<std::string, int>> cases = {
      {"60e-6", 0}, {"120e-6", 1}, {"170e-6", 2}, {"230e-6", 2}};
  for (const auto& [backlash, code] : cases) {
    done("simulate rig.yaml --duration 1 --backlash " + backlash + " --out a.csv");
    const Outcome outcome = run("diagnose_record a.csv --rig rig.yaml --method lost_motion --json a.json");
    EXPECT_EQ(outcome.code, code) << backlash << outcome.out;
    expect_contains(outcome.out, " deg");
    expect_contains(outcome.out, "verdict: ");
    EXPECT_EQ(Json::parse(read("a.json"))["estimates"].size(), 1u);
  }
  write("still.csv", "time,motor_torque,motor_position,sensor_torque\n0,0,0,0\n0.001,0,0,0\n0.002,0,0,0\n");
  const Outcome outcome = run("diagnose_record still.csv --rig rig.yaml --method lost_motion --json a.json");
  EXPECT_EQ(outcome.code, 3) << outcome.out;
  EXPECT_TRUE(Json::parse(read("a.json"))["verdict"]["estimate"].is_null());
}

TEST_F(Commands, WithoutARigOnlyWhatTheCurveAllows) {
  done("simulate rig.yaml --duration 1 --backlash 0 --out a.csv");
  done("build_curve rig.yaml --points 5 --seeds 2 --periods 2 --out c.yaml");
  Json json = report("a.csv --curve c.yaml --method lost_motion", 3);
  EXPECT_EQ(json["estimates"][0]["status"], "insufficient_data");
  EXPECT_EQ(json["estimates"][0]["message"], "needs --rig");
  EXPECT_TRUE(json["rig"].is_null());
  json = report("a.csv", 3);
  EXPECT_EQ(json["estimates"][0]["message"], "needs --rig or --curve");
  EXPECT_TRUE(json["apd"].is_null());
  EXPECT_TRUE(json["curve"].is_null());
  const Outcome with_curve = run("diagnose_record a.csv --curve c.yaml --method apd_skewness --json -");
  const Outcome with_both =
      run("diagnose_record a.csv --rig rig.yaml --curve c.yaml --method apd_skewness --json -");
  EXPECT_EQ(Json::parse(with_curve.out)["estimates"], Json::parse(with_both.out)["estimates"]);
  EXPECT_FALSE(Json::parse(with_curve.out)["estimates"][0]["skewness"].is_null());
}

TEST_F(Commands, CurveIsBuiltWhereNoneIsGiven) {
  write("fast.yaml", rig_variant(false, true));
  done("simulate fast.yaml --duration 0.4 --sample-rate 2000 --backlash 0 --out a.csv");
  const Outcome outcome = run("diagnose_record a.csv --rig fast.yaml --method apd_skewness --json -");
  expect_contains(outcome.err, "building one");
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json["curve"]["source"], "built for this record");
  EXPECT_EQ(json["curve"]["sampling_rate"], 2000.0);
  EXPECT_NE(json["estimates"][0]["status"], "insufficient_data");
  EXPECT_NE(json["estimates"][0]["status"], "out_of_domain");
  EXPECT_EQ(run("diagnose_record a.csv --rig fast.yaml --method lost_motion --json -").err, "");
}

TEST_F(Commands, StaleCurveIsReported) {
  write("noisy.yaml", rig_variant(true, false));
  done("simulate rig.yaml --duration 0.5 --out a.csv");
  done("build_curve noisy.yaml --points 2 --seeds 1 --periods 1 --out c.yaml");
  const Outcome outcome = run("diagnose_record a.csv --rig rig.yaml --curve c.yaml --json -");
  expect_contains(Json::parse(outcome.out)["warnings"].dump(), "another version of the rig file");
}

TEST_F(Commands, PeriodsKeepsTheLastOnes) {
  done("simulate rig.yaml --duration 2 --backlash 6e-5 --out a.csv");
  done("build_curve rig.yaml --points 2 --seeds 1 --periods 1 --out c.yaml");
  const std::string rest = "a.csv --rig rig.yaml --curve c.yaml ";
  const Json all = report(rest, 0), last = report(rest + "--periods 4", 0),
             more = report(rest + "--periods 40", 0);
  EXPECT_EQ(all["apd"]["periods"], 18);
  EXPECT_EQ(last["apd"]["periods"], 4);
  const auto& periods = all["apd"]["skewness_of_periods"];
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(last["apd"]["skewness_of_periods"][i], periods[14 + i]);
  EXPECT_EQ(more["apd"]["periods"], 18);
  expect_contains(more["warnings"].dump(), "shorter");
}

TEST_F(Commands, RepeatedStampsAreReported) {
  write("a.csv", "time,motor_torque\n0,1\n0.1,2\n0.1,3\n0.2,1\n");
  expect_contains(run("convert_record a.csv a.bag").err, "repeated time stamp");
  expect_contains(report("a.csv", 3)["warnings"].dump(), "repeated time stamp");
}

TEST_F(Commands, EachMethodAloneGetsWhatItNeeds) {
  done("simulate rig.yaml --duration 1 --backlash 6e-5 --out a.csv");
  for (const std::string& method : diagnosis::diagnosis_methods()) {
    const Json json =
        Json::parse(run("diagnose_record a.csv --rig rig.yaml --method " + method + " --json -").out);
    ASSERT_EQ(json["estimates"].size(), 1u);
    EXPECT_EQ(json["estimates"][0]["method"], method);
    const std::string message = json["estimates"][0]["message"];
    EXPECT_EQ(message.find("no monitoring curve"), std::string::npos) << method << ": " << message;
  }
  const Json json = Json::parse(run("diagnose_record a.csv --json -").out);
  for (const Json& e : json["estimates"])
    EXPECT_EQ(e["message"], diagnosis::needs_curve(e["method"]) ? "needs --rig or --curve" : "needs --rig");
}

TEST_F(Commands, CurveIsDrawnWhole) {
  // At 100 kHz there is one sampling phase, and the curve's file is small.
  const std::string start =
      "build_curve rig.yaml --points 3 --seeds 1 --periods 1 --sample-rate 100000 --out c.yaml --plot c.png";
  done(start);
  EXPECT_EQ(read("c.png").substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(files(), 3u);
  std::filesystem::remove(path("c.yaml"));
  std::filesystem::remove(path("c.png"));
  const Outcome outcome =
      run(start, "trap '' XFSZ; ulimit -f 64;");  // room for the curve, not for the picture
  EXPECT_EQ(outcome.code, 73) << outcome.err;
  EXPECT_TRUE(exists("c.yaml"));
  EXPECT_EQ(files(), 2u);
}

}  // namespace
}  // namespace backlash::test
