// SPDX-License-Identifier: BSD-3-Clause
// Plays of a robot's joint from the motor's side alone, whose truth is the simulator's, up to six times the
// declared one (5.4e-4 rad).
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

class MotorsAlone : public CommandTest {
 protected:
  nlohmann::json estimate(double play, int seed) const {
    const std::string rig = package_file("config/simulated_robot/shoulder.yaml");
    done(fmt::format("simulate {} --duration 25 --backlash {} --seed {} --out run.csv", rig, play, seed));
    run("diagnose_record run.csv --rig " + rig + " --method gap_traverse --json out.json");
    return nlohmann::json::parse(read("out.json")).at("estimates").at(0);
  }
  static bool holds(const nlohmann::json& e, double play) {
    return e.at("interval_angle").at(0).get<double>() <= play &&
           play <= e.at("interval_angle").at(1).get<double>();
  }
};

// Records of which earlier versions reported 0.2 to 0.75 of the play, with nothing but noise left.
TEST_F(MotorsAlone, ALargePlayIsNotReportedAsASmallOne) {
  for (const auto& [play, seed] : {std::pair{2e-3, 7}, {3e-3, 5}}) {
    const nlohmann::json e = estimate(play, seed);
    EXPECT_TRUE(e.at("status") != "ok" || holds(e, play)) << play << " " << seed << " " << e;
  }
}

// Among them some that found a wrong answer or none, as the fit stood still on its way. Of 256 answers on
// records of other seeds four were more than 4 % off, none more than 8 %.
TEST_F(MotorsAlone, APlayThatIsNotTheDeclaredOneIsEstimated) {
  for (const auto& [play, seed] :
       {std::pair{7e-4, 1}, {7e-4, 2}, {1e-3, 1}, {2.2e-4, 20}, {1e-3, 35}, {2e-3, 3}, {2e-3, 8}}) {
    const nlohmann::json e = estimate(play, seed);
    ASSERT_EQ(e.at("status"), "ok") << play << " " << seed << " " << e;
    EXPECT_NEAR(e.at("backlash_angle"), play, 0.05 * play) << seed << " " << e;
  }
}

}  // namespace
}  // namespace backlash::test
