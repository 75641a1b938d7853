// SPDX-License-Identifier: BSD-3-Clause
// Records of a separate program with known half gap (data/README.md): a check against somebody else's
// simulation.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

class KnownGaps : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::filesystem::create_symlink(package_file("config/sarkar_1997.yaml"), path("rig.yaml"));
  }
};

TEST_F(KnownGaps, LieInTheIntervals) {
  if (!find_data("rig/rig_halfgap_0um.csv")) GTEST_SKIP() << "no measured records (BACKLASH_DIAGNOSIS_DATA)";
  const std::vector<std::pair<int, int>> cases = {
      {0, 0}, {30, 0}, {55, 1}, {80, 2}};  // half gap in um, exit code
  done("build_curve rig.yaml --points 21 --seeds 4 --periods 4 --out c.yaml");
  for (const auto& [half_gap, code] : cases) {
    const std::string record = *find_data("rig/rig_halfgap_" + std::to_string(half_gap) + "um.csv");
    const Outcome outcome = run("diagnose_record " + record + " --rig rig.yaml --curve c.yaml --json -");
    ASSERT_EQ(outcome.code, code) << half_gap << outcome.err;
    const Json json = Json::parse(outcome.out);
    const double truth = 2e-6 * half_gap;
    for (const Json& estimate : json["estimates"]) {
      const Json& interval = estimate["interval"];
      if (interval.is_null()) continue;  // a null end is an open one
      EXPECT_TRUE(interval[0].is_null() || interval[0].get<double>() <= truth)
          << half_gap << estimate.dump(1);
      EXPECT_TRUE(interval[1].is_null() || interval[1].get<double>() >= truth)
          << half_gap << estimate.dump(1);
    }
    const Json& chosen = json["estimates"][json["verdict"]["estimate"].get<int>()];
    EXPECT_NEAR(chosen["backlash"].get<double>(), truth, 3e-6) << half_gap;  // the accuracy that is asked for
  }
}

}  // namespace
}  // namespace backlash::test
