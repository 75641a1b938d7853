// SPDX-License-Identifier: BSD-3-Clause
// `trace_residual` as its users run it, on records of machines that have an effect more than the rig
// declares.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <random>
#include <regex>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

const std::string kAsymmetry = "\nterms:\n  - id: asymmetric_viscous\n    body: motor\n    damping: 30\n";
const std::string kGravity = "\nterms:\n  - id: gravity\n    amplitude: 60\n    phase: 0.4\n";

class TraceResidual : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    for (const char* name : {"two_inertia_servo", "emps"})
      write(std::string(name) + ".yaml", content(package_file("config/" + std::string(name) + ".yaml")));
  }

  /// A record of the rig with these terms, shaken by a random torque of this size that the seed chooses.
  void record(const std::string& rig, const std::string& terms, double rms, int seed,
              const std::string& arguments, const std::string& out) {
    const std::string shaking =
        "excitation:\n  type: random\n  rms: " + std::to_string(rms) +
        "\n  lower_frequency: 0.15\n  upper_frequency: " + (rig == "emps" ? "3" : "8") +
        "\n  lines: 60\n  seed: " + std::to_string(seed) + "\n";
    write("machine.yaml",
          std::regex_replace(read(rig + ".yaml"), std::regex("excitation:\n(  .*\n)+"), shaking) + terms);
    done("simulate machine.yaml --seed " + std::to_string(seed) + " " + arguments + " --out " + out);
  }

  void emps_records(const std::string& terms) {
    record("emps", terms, 40, 1, "--duration 12 --sample-rate 250", "train.csv");
    record("emps", terms, 40, 2, "--duration 12 --sample-rate 250", "test.csv");
  }

  Json report(const std::string& folder = "out") const { return Json::parse(read(folder + "/report.json")); }
};

const std::string kEmps = "trace_residual --rig emps.yaml --train train.csv --test test.csv --out out";

/// Ids of all effects that were added.
std::vector<std::string> effects(const Json& report) {
  std::vector<std::string> ids;
  for (const Json& step : report.at("steps")) ids.push_back(step.at("effect"));
  return ids;
}

void expect_contract(const Json& report) {
  EXPECT_EQ(report.at("schema_version"), 1);
  for (const Json& channel : report.at("channels"))
    for (const char* key : {"before", "after", "floor"}) EXPECT_GT(channel.at(key).get<double>(), 0) << key;
  for (const Json& step : report.at("steps")) {
    EXPECT_TRUE(report.at("channels").contains(step.at("channel").get<std::string>()));
    EXPECT_FALSE(step.at("parameters").empty());
    for (const Json& parameter : step.at("parameters")) {
      EXPECT_TRUE(parameter.at("value").is_number());
      EXPECT_TRUE(parameter.at("unit").is_string());
      EXPECT_TRUE(parameter.contains("standard_error"));
    }
    EXPECT_LT(step.at("test_error_after"), step.at("test_error_before"));
    EXPECT_GT(step.at("evidence").at("gain_held_out").get<double>(), 0);
    EXPECT_TRUE(step.at("equivalent_to").is_array());
  }
  for (const Json& channel : report.at("channels")) EXPECT_LE(channel.at("explainable").get<double>(), 1);
  if (!report.at("unexplained").is_null())
    EXPECT_TRUE(report.at("unexplained").at("explainable").is_number());
  EXPECT_TRUE(report.contains("unexplained"));
}

TEST_F(TraceResidual, NamesTheEffectThatAnAxisLacks) {
  emps_records(kAsymmetry);
  const std::string out = done(kEmps).out;
  for (const char* part : {"The declared model lacks asymmetric_viscous", "before", "after", "noise alone",
                           "damping", "N s/m", "evidence", "report: out/report.html"})
    expect_contains(out, part);
  const Json result = report();
  expect_contract(result);
  EXPECT_EQ(result.at("verdict"), "effect_found");
  EXPECT_EQ(effects(result), std::vector<std::string>{"asymmetric_viscous"});
  const Json& damping = result.at("steps")[0].at("parameters").at("damping");
  // Four standard errors.
  EXPECT_NEAR(damping.at("value").get<double>(), 30, 4 * damping.at("standard_error").get<double>());
  EXPECT_EQ(damping.at("unit"), "N s/m");
  EXPECT_EQ(result.at("steps")[0].at("choices").at("body"), "motor");
  EXPECT_NEAR(result.at("parameters").at("motor_inertia").at("value").get<double>() / 95.1, 1, 0.02);
  const std::string page = read("out/report.html");
  for (const char* part : {"asymmetric_viscous", "data:image/png;base64,", "</html>"})
    expect_contains(page, part);
  EXPECT_EQ(page.find("http:"), std::string::npos);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(path("out")), {}), 4);
  done("simulate out/rig.yaml --duration 0.1 --out again.csv");
  expect_contains(read("out/rig.yaml"), "- id: asymmetric_viscous");
}

TEST_F(TraceResidual, WithTheEffectInTheRigNothingIsMissing) {
  emps_records(kAsymmetry);
  record("emps", kAsymmetry, 40, 3, "--duration 12 --sample-rate 250", "more.csv");
  write("emps.yaml", read("emps.yaml") + kAsymmetry);
  done("convert_record train.csv train.bag --rig emps.yaml");
  const std::string out =
      done("trace_residual --rig emps.yaml --train train.bag more.csv --test test.csv --out out --cutoff 8")
          .out;
  expect_contains(out, "Nothing is missing");
  const Json result = report();
  expect_contract(result);
  EXPECT_EQ(result.at("verdict"), "nothing_missing");
  EXPECT_TRUE(result.at("steps").empty());
  EXPECT_TRUE(result.at("unexplained").is_null());
  EXPECT_EQ(result.at("cutoff").at("value"), 8);
  EXPECT_EQ(result.at("train"), (Json{"train.bag", "more.csv"}));
  const std::string rig = read("out/rig.yaml");
  EXPECT_NE(rig.find(kAsymmetry), std::string::npos) << rig;  // as it was declared
  done("simulate out/rig.yaml --duration 0.1 --out again.csv");
}

TEST_F(TraceResidual, NamesTheEffectThatAServoLacks) {
  record("two_inertia_servo", kGravity, 250, 1, "--duration 6", "train.csv");
  record("two_inertia_servo", kGravity, 250, 2, "--duration 6", "test.csv");
  done("trace_residual --rig two_inertia_servo.yaml --train train.csv --test test.csv --out out");
  const Json result = report();
  expect_contract(result);
  EXPECT_EQ(effects(result), std::vector<std::string>{"gravity"});
  const Json& amplitude = result.at("steps")[0].at("parameters").at("amplitude");
  EXPECT_NEAR(amplitude.at("value").get<double>(), 60, 4 * amplitude.at("standard_error").get<double>());
  for (const char* channel : {"torque", "deflection"}) {
    const Json& errors = result.at("channels").at(channel);
    // Both are estimates from some 700 independent values: 3 % each; and the fit is not perfect.
    EXPECT_LT(errors.at("after").get<double>(), 1.2 * errors.at("floor").get<double>()) << channel;
    EXPECT_GT(errors.at("before").get<double>(), 5 * errors.at("after").get<double>()) << channel;
  }
  done("simulate out/rig.yaml --duration 0.1 --out again.csv");
}

/// A record at one speed under one torque, with the noise of encoder and torque.
std::string at_one_speed(unsigned seed) {
  std::string csv = "time,motor_torque,motor_position\n";
  std::mt19937_64 random(seed);
  std::normal_distribution<double> draw;
  for (int k = 0; k < 6000; ++k)
    csv += fmt::format("{:.3f},{:.6f},{:.9f}\n", 0.01 * k, 1.5 + 0.01 * draw(random),
                       0.3 * 0.01 * k + 2e-5 * draw(random));
  return csv;
}

// At one speed the inertia has no part in the torque, and the two frictions are one number. By the noise that
// is drawn some motion seems to stand out of it, and the torque is noise, or none does, and nothing is
// fitted.
TEST_F(TraceResidual, RecordsAtOneSpeedEndInAReportThatSaysWhyThereIsNoAnswer) {
  write("ur10e_joint.yaml", content(package_file("config/ur10e_joint.yaml")));
  int not_fitted = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    write("train.csv", at_one_speed(seed));
    write("test.csv", at_one_speed(100 + seed));
    const Outcome outcome =
        run("trace_residual --rig ur10e_joint.yaml --train train.csv --test test.csv --out out");
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    expect_contains(outcome.out, "Cannot tell what is missing: ");
    const Json result = report();
    EXPECT_EQ(result.at("verdict"), "unexplained");
    EXPECT_TRUE(result.at("steps").empty());
    for (const char* error : {"before", "after", "floor"})
      EXPECT_TRUE(result.at("channels").at("torque").at(error).is_null()) << error;
    const std::string why = result.at("unexplained").at("signature");
    not_fitted += why.find("the declared machine cannot be fitted") == 0;
    expect_contains(read("out/report.html"), "Cannot tell what is missing");
  }
  EXPECT_GT(not_fitted, 0);
  EXPECT_LT(not_fitted, 8);
  done("simulate out/rig.yaml --duration 0.1 --out again.csv");
}

TEST_F(TraceResidual, WithoutMatplotlibThePageSaysWhyItHasNoPlots) {
  emps_records("");
  write("matplotlib.py", "raise ImportError('no matplotlib here')\n");
  const Outcome outcome = run(kEmps, "PYTHONPATH='" + path("") + "'");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  expect_contains(read("out/report.html"), "No plots were drawn: trace_report.py ended with exit code 70");
  EXPECT_EQ(read("out/report.html").find("<img"), std::string::npos);
}

/// The record with its load encoder gone.
std::string without_load(const std::string& csv) {
  const std::string with = "load_", without = "reference_";  // another column, of no use here
  const std::size_t at = csv.find(with);
  EXPECT_NE(at, std::string::npos);
  return csv.substr(0, at) + without + csv.substr(at + with.size());
}

TEST_F(TraceResidual, RecordsOfTwoMachinesContradictEachOther) {
  record("two_inertia_servo", "", 250, 1, "--duration 6", "train.csv");
  write("declared.yaml", read("two_inertia_servo.yaml"));
  write("two_inertia_servo.yaml",
        std::regex_replace(read("declared.yaml"), std::regex("inertia: 108 "), "inertia: 140 "));
  record("two_inertia_servo", "", 250, 2, "--duration 6", "test.csv");
  const Outcome outcome =
      run("trace_residual --rig declared.yaml --train train.csv --test test.csv --out out");
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  expect_contains(outcome.out, "The records contradict each other");
  const Json result = report();
  EXPECT_EQ(result.at("verdict"), "unexplained");
  EXPECT_TRUE(result.at("steps").empty());
  const Json& several = result.at("several_machines");
  EXPECT_EQ(several.at("differ"), Json{"load_inertia"});
  for (const auto& [place, truth] : std::vector<std::pair<int, double>>{{0, 108}, {1, 140}}) {
    const Json& inertia = several.at("records").at(place).at("parameters").at("load_inertia");
    EXPECT_NEAR(inertia.at("value").get<double>(), truth, 4 * inertia.at("standard_error").get<double>());
  }
}

TEST_F(TraceResidual, Refusals) {
  emps_records("");
  const std::string head = read("test.csv").substr(0, 400);
  write("short.csv", head.substr(0, head.rfind('\n') + 1));
  write("nan.csv", "time,motor_torque,motor_position\n0,1,0\n0.004,nan,0\n0.008,1,0\n");
  write("text.csv", "no record\n");
  done("convert_record test.csv half.csv --from 6");
  write("bad.yaml", "schema_version: 1\nname: 3\n");
  write("motor.csv", without_load(read("train.csv")));
  const std::size_t before = files();
  const auto line = [](const std::string& rig, const std::string& train, const std::string& test,
                       const std::string& out = "out") {
    return "trace_residual --rig " + rig + " --train " + train + " --test " + test + " --out " + out;
  };
  const std::vector<std::tuple<std::string, int, std::string>> cases = {
      {"trace_residual --rig emps.yaml --test test.csv --out out", 64, "missing --train"},
      {"trace_residual --rig emps.yaml --train --test test.csv --out out", 64, "missing --test"},
      {kEmps + " --cutoff 0", 64, "cutoff"},
      {line("emps.yaml", "train.txt", "test.csv"), 64, "train.txt"},
      {line("none.yaml", "train.csv", "test.csv"), 66, "none.yaml"},
      {line("emps.yaml", "train.csv none.csv", "test.csv"), 66, "none.csv"},
      {line("emps.yaml", "train.csv", "none.bag"), 66, "none.bag"},
      {line("bad.yaml", "train.csv", "test.csv"), 65, "bad.yaml"},
      {line("emps.yaml", "text.csv", "test.csv"), 65, "text.csv"},
      {line("emps.yaml", "nan.csv", "test.csv"), 65, "nan"},
      {line("emps.yaml", "train.csv", "nan.csv"), 65, "nan"},
      {line("emps.yaml", "short.csv", "test.csv"), 65, "short"},
      {line("emps.yaml", "train.csv", "short.csv"), 65, "short"},
      {line("emps.yaml", "train.csv test.csv", "test.csv"), 65,
       "100 % of the test record test.csv are samples"},
      {line("emps.yaml", "train.csv half.csv", "test.csv"), 65, "samples of the training record half.csv"},
      {line("two_inertia_servo.yaml", "motor.csv", "test.csv"), 65, "load_position"},
      {line("emps.yaml", "train.csv", "test.csv", "test.csv"), 73, "test.csv"},
      {line("emps.yaml", "train.csv", "test.csv", "/proc/none"), 73, "/proc/none"},
  };
  for (const auto& [command, code, message] : cases) {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.code, code) << command << "\n" << outcome.err;
    expect_contains(outcome.err, message);
    EXPECT_EQ(outcome.out, "") << command;
  }
  EXPECT_EQ(files(), before);  // no folder is left behind
}

TEST_F(TraceResidual, NeverReplacesItsInputs) {
  emps_records("");
  std::filesystem::create_directory(path("out"));
  std::filesystem::rename(path("emps.yaml"), path("out/rig.yaml"));
  const std::string rig = read("out/rig.yaml");
  const Outcome outcome =
      run("trace_residual --rig out/rig.yaml --train train.csv --test test.csv --out out");
  EXPECT_EQ(outcome.code, 64);
  expect_contains(outcome.err, "would overwrite");
  EXPECT_EQ(read("out/rig.yaml"), rig);
}

}  // namespace
}  // namespace backlash::test
