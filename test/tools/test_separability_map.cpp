// SPDX-License-Identifier: BSD-3-Clause
// separability_map and the pictures of Sarkar et al. as their users run them.
#include <nlohmann/json.hpp>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

class SeparabilityMapCommand : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::filesystem::create_symlink(package_file("config/sarkar_1997.yaml"), path("rig.yaml"));
  }
};

const std::string kQuick = "separability_map rig.yaml --curve curve.yaml --points 2 --records 1 --periods 2 ";

TEST_F(SeparabilityMapCommand, WritesTableJsonAndPicture) {
  done("build_curve rig.yaml --points 5 --periods 2 --seeds 2 --out curve.yaml");
  const Outcome outcome = done(kQuick + "--json map.json --plot map.png");
  for (const char* part : {"sensor noise", "viscous friction", "constant load", "stiffness"})
    expect_contains(outcome.out, part);
  EXPECT_EQ(read("map.png").substr(1, 3), "PNG");
  const Json map = Json::parse(read("map.json"));
  EXPECT_EQ(map["schema_version"], 1);
  EXPECT_EQ(map["backlash"].size(), 2u);
  ASSERT_EQ(map["maps"].size(), 9u);
  for (const Json& one : map["maps"])
    for (const char* method : {"apd_skewness", "apd_shape"}) {
      const Json& cells = one["methods"][method];
      ASSERT_EQ(cells["status"].size(), one["levels"].size());
      for (std::size_t i = 0; i < one["levels"].size(); ++i)
        for (std::size_t k = 0; k < 2; ++k)
          EXPECT_EQ(cells["right"][i][k].get<int>() + cells["wrong"][i][k].get<int>() +
                        cells["refused"][i][k].get<int>(),
                    1);  // the one record
    }
  done(kQuick + "--json again.json");
  EXPECT_EQ(read("again.json"), read("map.json"));
}

TEST_F(SeparabilityMapCommand, UsageErrorsEndWith64) {
  for (const std::string& line : std::vector<std::string>{
           "separability_map", "separability_map rig.yaml",
           "separability_map rig.yaml --json m.json --points 1",
           "separability_map rig.yaml --json m.json --noise -1",
           "separability_map rig.yaml --json m.json --plot m.txt", "plot_sarkar_1997.py",
           "plot_sarkar_1997.py --out . --wrong", "plot_separability_map.py --out map.png"}) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, 64) << line << "\n" << outcome.err;
    expect_contains(outcome.err, "--help");
  }
  write("no_map.json", "{}");
  EXPECT_EQ(run("plot_separability_map.py no_map.json --out map.png").code, 65);
  EXPECT_EQ(run("plot_separability_map.py absent.json --out map.png").code, 66);
  EXPECT_EQ(run("plot_sarkar_1997.py --rig absent.yaml --out .").code, 66);  // as build_curve says
}

}  // namespace
}  // namespace backlash::test
