// SPDX-License-Identifier: BSD-3-Clause
// Limits, baselines and other signals from the command line.
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

class MachineFiles : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    write("rig.yaml", content(package_file("config/sarkar_1997.yaml")));
    done("simulate rig.yaml --duration 1 --backlash 6e-5 --out new.csv");
    done("simulate rig.yaml --duration 1 --backlash 17e-5 --out worn.csv");
  }

  Outcome diagnosed(const std::string& arguments) const {
    return run("diagnose_record " + arguments + " --method lost_motion --json -");
  }
};

TEST_F(MachineFiles, GrowthIsCountedFromTheSavedBaseline) {
  EXPECT_EQ(diagnosed("new.csv --rig rig.yaml --save-baseline healthy.yaml").code, 0);
  const std::string baseline = read("healthy.yaml");
  expect_contains(baseline, "rig: \"sarkar_1997\"");
  expect_contains(baseline, "methods: [\"lost_motion\"]");
  const Outcome outcome = diagnosed("worn.csv --rig rig.yaml --baseline healthy.yaml");
  EXPECT_EQ(outcome.code, 1) << outcome.out;  // 110 um more: watch; by itself 170 um is service, code 2
  const Json verdict = Json::parse(outcome.out)["verdict"];
  EXPECT_NEAR(verdict["growth"].get<double>(), 11e-5, 3e-6);
  EXPECT_LE(verdict["growth_interval"][0].get<double>(), 11e-5);
  EXPECT_GE(verdict["growth_interval"][1].get<double>(), 11e-5);
  EXPECT_TRUE(Json::parse(outcome.out)["warnings"].empty());
  expect_contains(verdict["message"], "grown by");
  expect_contains(verdict["message"], "since the baseline");
  // Renewing it from itself gives the same file: there is no date in it.
  EXPECT_EQ(diagnosed("new.csv --rig rig.yaml --baseline healthy.yaml --save-baseline healthy.yaml").code, 0);
  EXPECT_EQ(read("healthy.yaml"), baseline);
}

TEST_F(MachineFiles, VerdictHasTheDocumentedKeys) {
  const Json verdict = Json::parse(diagnosed("new.csv --rig rig.yaml").out)["verdict"];
  std::vector<std::string> keys;
  for (const auto& item : verdict.items()) keys.push_back(item.key());
  EXPECT_EQ(keys, (std::vector<std::string>{"grade", "estimate", "agreement", "members", "dissenters",
                                            "backlash", "interval", "backlash_angle", "angle_interval",
                                            "growth", "growth_interval", "message"}));
  EXPECT_EQ(verdict["estimate"], 0);
  EXPECT_EQ(verdict["members"], Json::array({"lost_motion"}));
  EXPECT_TRUE(verdict["dissenters"].empty());
  EXPECT_NEAR(verdict["backlash"].get<double>(), 6e-5, 3e-6);
  EXPECT_TRUE(verdict["growth"].is_null());
  EXPECT_TRUE(verdict["growth_interval"].is_null());
}

TEST_F(MachineFiles, ABaselineMustBeOfThisRig) {
  diagnosed("new.csv --rig rig.yaml --save-baseline healthy.yaml");
  write("edited.yaml", read("rig.yaml") + "# a remark\n");
  Outcome outcome = diagnosed("worn.csv --rig edited.yaml --baseline healthy.yaml");
  EXPECT_EQ(outcome.code, 1);
  expect_contains(Json::parse(outcome.out)["warnings"].dump(), "taken with another version of the rig file");
  write("other.yaml",
        std::regex_replace(read("rig.yaml"), std::regex("\nname: sarkar_1997"), "\nname: elbow"));
  outcome = diagnosed("worn.csv --rig other.yaml --baseline healthy.yaml");
  EXPECT_EQ(outcome.code, 65) << outcome.out;
  expect_contains(outcome.err, "healthy.yaml: the baseline is of the rig 'sarkar_1997', not of 'elbow'");
  EXPECT_EQ(diagnosed("worn.csv --rig rig.yaml --baseline nowhere.yaml").code, 66);
  EXPECT_EQ(diagnosed("worn.csv --rig rig.yaml --baseline rig.yaml").code, 65);
  EXPECT_EQ(diagnosed("worn.csv --baseline healthy.yaml").code, 64);
  EXPECT_EQ(diagnosed("worn.csv --rig rig.yaml --save-baseline rig.yaml").code, 64);
  EXPECT_EQ(diagnosed("worn.csv --rig rig.yaml --save-baseline /nowhere/healthy.yaml").code, 73);
}

TEST_F(MachineFiles, NoBaselineIsSavedWithoutAnAnswer) {
  write("still.csv", "time,motor_torque,motor_position\n0,0,0\n0.001,0,0\n0.002,0,0\n");
  const Outcome outcome = diagnosed("still.csv --rig rig.yaml --save-baseline healthy.yaml");
  EXPECT_EQ(outcome.code, 3);
  expect_contains(outcome.err, "healthy.yaml not written: sarkar_1997: no baseline");
  EXPECT_FALSE(exists("healthy.yaml"));
}

TEST_F(MachineFiles, LimitsOfAFileTakeThePlaceOfTheRigs) {
  write("limits.yaml", "schema_version: 1\nbacklash: {watch: 1e-5, service: 2e-5, stop: 5e-4}\n");
  EXPECT_EQ(diagnosed("new.csv --rig rig.yaml").code, 0);
  EXPECT_EQ(diagnosed("new.csv --rig rig.yaml --limits limits.yaml").code, 2);
  write("bad.yaml", "schema_version: 1\nbacklash: {watch: 3e-5, service: 2e-5, stop: 5e-4}\n");
  const Outcome outcome = diagnosed("new.csv --rig rig.yaml --limits bad.yaml");
  EXPECT_EQ(outcome.code, 65);
  expect_contains(outcome.err, "bad.yaml:2: backlash.service");
  EXPECT_EQ(diagnosed("new.csv --rig rig.yaml --limits nowhere.yaml").code, 66);
}

TEST_F(MachineFiles, ACommandedCurrentGivesAFlatCurveAndNoAnswer) {
  std::string text = read("rig.yaml");
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"\n  motor:\n", "\n  motor:\n    torque_constant: 0.02\n"},
           {"\nsensors:\n", "\nsensors:\n  motor_current: {noise: 0.01}\n  acceleration: {}\n"},
           {"signal: sensor_torque", "signal: motor_current"},
           {"lower: -0.4 ", "lower: -5 "},
           {"upper: 0.4 ", "upper: 5 "}}) {
    const auto place = text.find(from);
    ASSERT_NE(place, std::string::npos) << from;
    text.replace(place, from.size(), to);
  }
  write("current.yaml", text);
  const Outcome built = done("build_curve current.yaml --points 3 --seeds 2 --periods 2 --out c.yaml");
  expect_contains(built.err, "the skewness of motor_current does not depend on backlash");
  done("simulate current.yaml --duration 1 --backlash 6e-5 --out a.csv");
  EXPECT_EQ(read("a.csv").substr(0, read("a.csv").find('\n')),
            "time,motor_torque,motor_position,motor_velocity,load_position,load_velocity,sensor_torque,"
            "motor_current,acceleration");
  done("convert_record a.csv a.bag");
  done("convert_record a.bag b.csv");
  EXPECT_EQ(read("a.csv"), read("b.csv"));
  const Outcome outcome =
      run("diagnose_record a.bag --rig current.yaml --curve c.yaml --method apd_skewness --json -");
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_EQ(Json::parse(outcome.out)["estimates"][0]["status"], "ambiguous");
}

}  // namespace
}  // namespace backlash::test
