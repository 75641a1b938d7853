// SPDX-License-Identifier: BSD-3-Clause
// The look-up table as torque: its curve, its coordinates, what a rig makes of it.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/term_text.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::model {
namespace {

std::shared_ptr<const Term> learned(const std::string& acts_on, const std::string& coordinate,
                                    const std::vector<double>& points, const std::vector<double>& values) {
  ParameterValues p;
  p.set_choice("acts_on", acts_on);
  p.set_choice("coordinate", coordinate);
  p.set_list("points", points);
  p.set_list("values", values);
  return make_term("learned_map", p);
}

double over_time(const std::vector<double>& points, const std::vector<double>& values, double t) {
  EndTorques ends;
  learned("load", "time", points, values)->add({t, 0, 0, 0, 0}, ends);
  EXPECT_EQ(ends.motor, 0);
  return ends.load;
}

const std::vector<double> kPoints = {-1, 0, 0.5, 2, 3.5}, kValues = {2, -1, 0.3, 4, 3};

TEST(LearnedMap, PassesItsPointsAndIsConstantBeyond) {
  for (std::size_t i = 0; i < kPoints.size(); ++i)
    EXPECT_NEAR(over_time(kPoints, kValues, kPoints[i]), kValues[i], 1e-15);
  EXPECT_EQ(over_time(kPoints, kValues, -50), 2);
  EXPECT_EQ(over_time(kPoints, kValues, 50), 3);
}

// Middle of [0.5, 2] by hand: mean of the values + width / 8 times the difference of the slopes at its ends,
// (4 + 1) / 2 and (3 - 0.3) / 3.
TEST(LearnedMap, IsTheCubicOfCatmullAndRom) {
  EXPECT_NEAR(over_time(kPoints, kValues, 1.25), 0.5 * (0.3 + 4) + 1.5 / 8 * (2.5 - 0.9), 1e-14);
  // the first piece leaves with slope 0: mean + 1 / 8 (0 - (0.3 - 2) / 1.5)
  EXPECT_NEAR(over_time(kPoints, kValues, -0.5), 0.5 * (2 - 1) + (0 + 1.7 / 1.5) / 8, 1e-14);
}

TEST(LearnedMap, HasNoCorners) {
  const double d = 1e-6;
  for (std::size_t i = 0; i < kPoints.size(); ++i) {
    const double x = kPoints[i], y = kValues[i];
    const double before = (y - over_time(kPoints, kValues, x - d)) / d;
    const double after = (over_time(kPoints, kValues, x + d) - y) / d;
    EXPECT_NEAR(before, after, 1e-4);  // curvature, up to some 30, times d
    if (i == 0 || i + 1 == kPoints.size()) {
      EXPECT_NEAR(after + before, 0, 1e-4);
    }
  }
}

TEST(LearnedMap, KeepsAParabolaOnEvenPoints) {
  std::vector<double> points, values;
  for (int i = 0; i <= 10; ++i) points.push_back(0.5 * i), values.push_back(points.back() * points.back());
  for (double x = 0.5; x < 4.5; x += 0.0173) EXPECT_NEAR(over_time(points, values, x), x * x, 1e-13);
}

TEST(LearnedMap, IsLinearInItsValues) {
  const std::vector<double> other = {0, 1, -2, 0.5, 7};
  std::vector<double> sum;
  for (std::size_t i = 0; i < other.size(); ++i) sum.push_back(3 * kValues[i] - 2 * other[i]);
  for (double t = -2; t < 5; t += 0.13)
    EXPECT_NEAR(over_time(kPoints, sum, t),
                3 * over_time(kPoints, kValues, t) - 2 * over_time(kPoints, other, t), 1e-13);
}

TEST(LearnedMap, FollowsEachCoordinateAndActsOnEitherEnd) {
  const Motion motion{1, 2, 3, 4, 5, 6};
  const std::vector<std::pair<const char*, double>> coordinates = {
      {"time", 1},          {"motor_position", 2}, {"motor_velocity", 3},
      {"load_position", 4}, {"load_velocity", 5},  {"mesh_torque", 6}};
  for (const auto& [name, value] : coordinates)
    for (const char* end : {"motor", "load"}) {
      const auto map = learned(end, name, {0, 1, 2, 3, 4, 5, 6, 7, 8}, {0, 1, 4, 9, 16, 25, 36, 49, 64});
      EndTorques ends{0.5, 0.25};
      map->add(motion, ends);
      const bool load = std::string(end) == "load";
      EXPECT_NEAR(ends.motor, 0.5 + (load ? 0 : value * value), 1e-13) << name;
      EXPECT_NEAR(ends.load, 0.25 + (load ? value * value : 0), 1e-13) << name;
      EXPECT_EQ(map->moves_load(), load);
      EXPECT_FALSE(map->shapes_flanks());
      EXPECT_FALSE(map->has_dry_friction());
    }
}

// A ramp of torque over time on a free body of 3 kg m^2: between even points J w = b t^2 / 2.
TEST(LearnedMap, MovesABody) {
  for (const char* end : {"motor", "load"}) {
    Rig rig;
    rig.motor.inertia = 1;
    rig.link.inertia = 2;
    rig.mesh.rigid = true;
    rig.terms = {learned(end, "time", {-1, 0, 1, 2, 3, 4}, {-2, 0, 2, 4, 6, 8})};
    simulation::Plant plant(rig, test::constant(0), test::solver(1e-10));
    plant.advance_to(2.5);
    EXPECT_NEAR(plant.state()[1], 2.5 * 2.5 / 3, 1e-8);  // solver
  }
}

TEST(LearnedMap, IsWrittenAndReadBack) {
  const auto map = learned("gap", "load_position", {-1.0 / 3, 0.1, 7}, {1e-5, -2e-300, 1.0 / 7});
  const std::string text = term_text(*map);
  EXPECT_EQ(text.substr(0, text.find("points")),
            "  - id: learned_map\n    acts_on: gap\n    coordinate: load_position\n    ");
  const YamlReader yaml = YamlReader::from_text("terms:\n" + text, "rig.yaml");
  const auto back = read_term(yaml.maps("terms").at(0));
  yaml.finish();
  for (const char* list : {"points", "values"}) EXPECT_EQ(back->values.list(list), map->values.list(list));
  EXPECT_EQ(term_text(*back), text);
}

}  // namespace
}  // namespace backlash::model
