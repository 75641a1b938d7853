// SPDX-License-Identifier: BSD-3-Clause
// compare_models as its users run it.
#include <nlohmann/json.hpp>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

class CompareModels : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    for (const char* name : {"_basic", "", "_varying", "_runs"}) {
      const std::string file = std::string("yumrukcal_2013") + name + ".yaml";
      std::filesystem::create_symlink(package_file("config/" + file), path(file));
    }
  }
  const std::string rigs_ = " yumrukcal_2013_basic.yaml yumrukcal_2013.yaml ";
};

TEST_F(CompareModels, TableJsonAndPicture) {
  done("simulate yumrukcal_2013.yaml --run square_wave --duration 4 --out a.csv");
  const std::string table = done("compare_models a.csv" + rigs_ + "--json a.json --plot a.svg").out;
  expect_contains(table,
                  "through 7 engagements");  // a switch every half second
  const auto json = nlohmann::json::parse(read("a.json"));
  ASSERT_EQ(json.at("models").size(), 2u);
  EXPECT_EQ(json["models"][1]["name"], "yumrukcal_2013");
  const double without = json["models"][0]["followed"]["deflection"]["error"],
               with = json["models"][1]["followed"]["deflection"]["error"];
  EXPECT_LT(with, 0.1 * without);
  EXPECT_EQ(json["engagements"].size(), json["models"][0]["peaks"].size());
  EXPECT_EQ(json["models"][1]["traces"]["deflection"].size(), 4000u);
  expect_contains(read("a.svg"), "<svg");
}

TEST_F(CompareModels, ExitCodes) {
  write("no_load.csv", "time,motor_torque,motor_position\n0,1,0\n1,2,1\n2,1,0\n3,2,1\n4,1,0\n5,2,1\n");
  EXPECT_EQ(run("compare_models no_load.csv --json a.json").code, 64);
  EXPECT_EQ(run("compare_models no_load.csv" + rigs_).code, 64);
  EXPECT_EQ(run("compare_models no_load.csv" + rigs_ + "--json yumrukcal_2013.yaml").code, 64);
  EXPECT_EQ(run("compare_models no_load.csv" + rigs_ + "--json a.json --after 0").code, 64);
  EXPECT_EQ(run("compare_models none.csv" + rigs_ + "--json a.json").code, 66);
  EXPECT_EQ(run("compare_models no_load.csv none.yaml --json a.json").code, 66);
  const Outcome outcome = run("compare_models no_load.csv" + rigs_ + "--json a.json");
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  expect_contains(outcome.err, "load_position");
  EXPECT_FALSE(exists("a.json"));
}

}  // namespace
}  // namespace backlash::test
