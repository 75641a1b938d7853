// SPDX-License-Identifier: BSD-3-Clause
// The command gear_geometry: figures as printed in the reference, JSON, refusals.
#include <cmath>
#include <nlohmann/json.hpp>

#include "support/data.h"
#include "tools/command_runner.h"

namespace backlash::test {
namespace {

using Json = nlohmann::ordered_json;

class GearGeometryCommand : public CommandTest {
 protected:
  Json json(const std::string& arguments) {
    return Json::parse(done("gear_geometry " + arguments + " --json -").out);
  }
};

TEST_F(GearGeometryCommand, DefaultsAreSarkarsGears) {
  const Json j = json("--centre-distance-change 50e-6");
  const Json& g = j["geometry"];
  EXPECT_NEAR(g["backlash"], 34.40e-6, 0.005e-6);  // as computed for Table 2 outside this code
  EXPECT_NEAR(g["contact_ratio"], 1.652, 0.0005);
  EXPECT_NEAR(g["small_change_backlash"], 34.20e-6, 0.005e-6);
  EXPECT_NEAR(g["operating_pressure_angle"].get<double>() * 180 / M_PI, 20.246, 0.0005);
  EXPECT_NEAR(g["pinion"]["base_radius"], 14.918e-3, 0.5e-6);
  const Json& mesh = j["mesh_stiffness"];
  // One pair in the middle of its life, phase eps / 2 = 0.826: 1.05e9 N/m, with bending about 9.2e7 N/m
  const std::size_t single = 330;
  EXPECT_NEAR(mesh["phase"][single], 0.825, 1e-12);
  EXPECT_EQ(mesh["pairs"][single], 1);
  EXPECT_EQ(mesh["pairs"][0], 2);
  EXPECT_EQ(mesh["phase"].size(), 800u);
  EXPECT_NEAR(mesh["laws"]["step"]["stiffness"][single], 1.05e9, 0.005e9);
  EXPECT_NEAR(mesh["laws"]["hertz_bending"]["stiffness"][single], 9.2e7,
              0.2e7);  // at a wider centre distance
  EXPECT_NEAR(mesh["laws"]["lin_parker"]["mean"], 0.85 * 1.6515 * 13.02e9 * 6.35e-3, 1e5);
}

TEST_F(GearGeometryCommand, BacklashGivesTheShimBack) {
  EXPECT_NEAR(json("--backlash 50e-6")["geometry"]["centre_distance_change"], 72.5e-6, 0.05e-6);
  const Json thin = json("--backlash 50e-6 --thinning1 100e-6");  // 94 um of play by thinning alone
  EXPECT_LT(thin["geometry"]["centre_distance_change"], 0);
  EXPECT_NEAR(thin["geometry"]["backlash"], 50e-6, 1e-15);
}

TEST_F(GearGeometryCommand, TableHoldsTheFiveRows) {
  const Outcome outcome = done("gear_geometry --centre-distance-change 100e-6 --table 5 --json t.json");
  for (const char* backlash : {"17.15", "34.40", "51.76", "69.21"}) expect_contains(outcome.out, backlash);
  const Json table = Json::parse(read("t.json"))["table"];
  ASSERT_EQ(table.size(), 5u);
  const double contact_ratio[] = {1.714, 1.682, 1.652, 1.621, 1.590};
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(table[i]["contact_ratio"], contact_ratio[i], 0.0005);
}

TEST_F(GearGeometryCommand, StopOfAHingedBracketAndSensorStep) {
  const std::string bracket = " --pivot-to-stop 0.2 --pivot-to-pinion 0.1 --mesh-angle-deg 60";
  // By hand: 200 um 0.1 / 0.2 cos 60 deg = 50 um; 40 teeth of 0.79375 mm: 15.875 mm 1e-3 pi / 180 = 0.27707
  // um.
  const Json j = json("--stop 200e-6 --pinion-step-deg 1e-3" + bracket);
  EXPECT_NEAR(j["geometry"]["centre_distance_change"], 50e-6, 1e-15);  // rounding of the cosine
  EXPECT_NEAR(j["geometry"]["stop"], 200e-6, 1e-15);
  EXPECT_NEAR(j["bracket"]["pivot_to_pinion"], 0.1, 0);
  EXPECT_NEAR(j["resolution"]["pitch_circle"], 0.27707e-6, 5e-12);
  EXPECT_NEAR(j["resolution"]["line_of_action"], 0.26036e-6, 5e-12);
  // 50 um of play need a shim of 72.5 um, four times that at the stop.
  EXPECT_NEAR(json("--backlash 50e-6" + bracket)["geometry"]["stop"], 4 * 72.5e-6, 4 * 0.05e-6);
  expect_contains(done("gear_geometry --stop 200e-6 --pinion-step-deg 1e-3" + bracket).out, "200.00");
  EXPECT_FALSE(json("--stop 200e-6" + bracket).contains("resolution"));
  EXPECT_EQ(json("--table 3 --stop 200e-6" + bracket)["table"].size(), 3u);
}

TEST_F(GearGeometryCommand, APairThatDoesNotRunIsReported) {
  const Outcome outcome = run("gear_geometry --centre-distance-change 620e-6 --json -");
  EXPECT_EQ(outcome.code, 2);
  expect_contains(outcome.err, "contact ratio 0.98");
  const Json j = Json::parse(outcome.out);
  EXPECT_EQ(j["geometry"]["faults"].size(), 1u);
  // On average 0.98901 pairs (standard involute theory) of 1.051e9 N/m each touch.
  EXPECT_NEAR(j["mesh_stiffness"]["laws"]["step"]["mean"], 0.98901 * 1.051e9, 1e6);
  const Json apart = Json::parse(run("gear_geometry --centre-distance-change 1e-3 --json -").out);
  EXPECT_TRUE(apart["mesh_stiffness"]["laws"]["step"]["mean"].is_null());
  EXPECT_EQ(run("gear_geometry --teeth1 12 --teeth2 12").code, 2);
  EXPECT_EQ(run("gear_geometry --centre-distance-change 620e-6 --table 2").code, 2);
}

TEST_F(GearGeometryCommand, NonsenseEndsWith64) {
  for (const char* arguments :
       {"--teeth1 2", "--module 0", "--pressure-angle-deg 50", "--backlash -1e-6",
        "--centre-distance-change -1e-6", "--thinning1 -1e-6",
        "--backlash 1e-6 --centre-distance-change 1e-6", "--table 1", "--stop 1e-6",
        "--stop 1e-6 --backlash 1e-6 --pivot-to-stop 1 --pivot-to-pinion 1", "--pivot-to-stop 1",
        "--pivot-to-stop 0 --pivot-to-pinion 1", "--pivot-to-stop 1 --pivot-to-pinion 1 --mesh-angle-deg 90",
        "--pinion-step-deg 0", "--poisson-ratio 1", "--centre-distance-change -3e-3", "gears.yaml"}) {
    const Outcome outcome = run(std::string("gear_geometry ") + arguments);
    EXPECT_EQ(outcome.code, 64) << arguments << "\n" << outcome.err;
    expect_contains(outcome.err, "see --help");
    EXPECT_EQ(outcome.out, "") << arguments;
  }
  EXPECT_EQ(run("gear_geometry --json no/such/folder.json").code, 73);
}

TEST_F(GearGeometryCommand, HelpStatesUnitsAndDefaults) {
  const std::string help = done("gear_geometry --help").out;
  for (const char* part : {"Usage: gear_geometry", "default: 40", "[m]", "Exit codes"})
    expect_contains(help, part);
}

}  // namespace
}  // namespace backlash::test
