// SPDX-License-Identifier: BSD-3-Clause
// The rig files of Yumrukcal (2013) against his tables, and their test runs against the limits of his
// machine.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "support/data.h"

namespace backlash::studies {
namespace {

constexpr double kDegree = M_PI / 180;

rig_file::RigFile rig(const std::string& model) {
  return rig_file::load_rig_file(test::package_file("config/yumrukcal_2013" + model + ".yaml"));
}

/// A row of Table 5.2; friction of the whole system.
struct Row {
  const char* model;
  double viscous_forward, viscous_backward, coulomb_forward, coulomb_backward, total_inertia, motor_inertia,
      stiffness, damping, backlash_degrees;
};
const Row kConfiguration1 = {"_config1", 18.0, 21.6, 79.4, 77.9, 48.9, 6.0, 355e3, 515, 0.0253};
const Row kConfiguration2 = {"", 21.3, 23.0, 79.8, 76.0, 114.6, 6.3, 460e3, 483, 0.0307};

void expect_row(const model::Rig& rig, const Row& row) {
  SCOPED_TRACE(rig.name);
  const auto forward = [](double mean, double asymmetry) { return mean + asymmetry; };
  EXPECT_NEAR(forward(rig.motor.viscous_damping, rig.motor.viscous_asymmetry), 13.7, 1e-12);
  EXPECT_NEAR(forward(rig.motor.viscous_damping, -rig.motor.viscous_asymmetry), 11.5, 1e-12);
  EXPECT_NEAR(forward(rig.motor.coulomb_friction, rig.motor.coulomb_asymmetry), 63.0, 1e-12);
  EXPECT_NEAR(forward(rig.motor.coulomb_friction, -rig.motor.coulomb_asymmetry), 62.7, 1e-12);
  const double viscous = rig.motor.viscous_damping + rig.link.viscous_damping;
  const double viscous_asymmetry = rig.motor.viscous_asymmetry + rig.link.viscous_asymmetry;
  EXPECT_NEAR(forward(viscous, viscous_asymmetry), row.viscous_forward, 1e-12);
  EXPECT_NEAR(forward(viscous, -viscous_asymmetry), row.viscous_backward, 1e-12);
  const double coulomb = rig.motor.coulomb_friction + rig.link.coulomb_friction;
  const double coulomb_asymmetry = rig.motor.coulomb_asymmetry + rig.link.coulomb_asymmetry;
  EXPECT_NEAR(forward(coulomb, coulomb_asymmetry), row.coulomb_forward, 1e-12);
  EXPECT_NEAR(forward(coulomb, -coulomb_asymmetry), row.coulomb_backward, 1e-12);
  EXPECT_NEAR(rig.motor.inertia + rig.link.inertia, row.total_inertia, 1e-12);
  EXPECT_EQ(rig.motor.inertia, row.motor_inertia);
  EXPECT_NEAR(rig.mesh.contact->force(1, 0, 0), row.stiffness, 1e-6);
  EXPECT_NEAR(rig.mesh.contact->force(1, 1, 0) - row.stiffness, row.damping, 1e-6);
  EXPECT_EQ(rig.reduction_ratio, 110);
}

TEST(YumrukcalRigs, HoldTable52) {
  for (const Row& row : {kConfiguration1, kConfiguration2}) {
    const model::Rig machine = rig(row.model).rig;
    expect_row(machine, row);
    EXPECT_NEAR(machine.mesh.backlash, row.backlash_degrees * kDegree, 5e-8);  // four digits
  }
  expect_row(rig("_basic").rig, kConfiguration2);
  EXPECT_EQ(rig("_basic").rig.mesh.backlash, 0);
  expect_row(rig("_varying").rig, kConfiguration2);
}

double opening(const model::Rig& rig, double load_position, double half_gap) {
  model::FlankShift shift;
  for (const auto& term : rig.terms) term->shape({load_position, load_position, half_gap, 0, 1}, shift);
  return shift.opening;
}

TEST(YumrukcalRigs, TheVaryingGapVariesUpTo15PercentAndItsTableIsTheSame) {
  const model::Rig series = rig("_varying").rig;
  std::stringstream text;
  text << std::ifstream(test::package_file("config/yumrukcal_2013_varying.yaml")).rdbuf();
  std::string file, line;
  bool table = false;
  while (std::getline(text, line)) {  // the table takes the place of the series
    if (line == "terms:") table = true;
    if (table && line.rfind("#   - id: backlash_map", 0) == 0) file += "terms:\n";
    if (table && line.rfind("#   ", 0) == 0) file += line.substr(1) + "\n";
    if (line == "excitation:" || line.rfind("excitation:", 0) == 0) table = false;
    if (!table) file += line + "\n";
  }
  const model::Rig map = rig_file::rig_file_from_text(file, test::package_file("config/as_table.yaml")).rig;
  ASSERT_EQ(map.terms.size(), 1u);
  const double half = 0.5 * series.mesh.backlash;
  double largest = 0;
  for (int i = 0; i < 360; ++i) largest = std::max(largest, std::fabs(opening(series, i * kDegree, half)));
  EXPECT_GT(largest, 0.10 * half);
  EXPECT_LT(largest, 0.15 * half);
  for (int i = 0; i < 12; ++i)  // four digits of the backlash, four decimals of the position
    EXPECT_NEAR(opening(map, i * M_PI / 6, half), opening(series, i * M_PI / 6, half), 5e-8) << i;
}

double speed_limit() {
  return 110 * kDegree;  // Table 3.1
}

TEST(YumrukcalRigs, TheirRunsStayWithinTheMachine) {
  const std::vector<std::string> expected = {"external_excitation",    "sine_sweep",
                                             "sine_sweep_bias",        "square_wave",
                                             "square_wave_forward",    "square_wave_backward",
                                             "constant_speed_forward", "constant_speed_backward",
                                             "friction_speeds",        "motor_friction_speeds",
                                             "inertia_sine",           "motor_inertia_sine"};
  for (const char* model : {"", "_config1", "_basic", "_varying"}) {
    std::vector<std::string> names;
    for (const rig_file::TestRun& run : rig(model).test_runs) names.push_back(run.name);
    EXPECT_EQ(names, expected) << model;
  }
  for (const rig_file::TestRun& run : rig("_config1").test_runs) {  // the lighter one is the faster one
    SCOPED_TRACE(run.name);
    rig_file::RigFile file = rig("_config1");
    rig_file::apply_test_run(run, file);
    file.simulation.sensors.sampling_rate = 50;
    const record::Record record = simulation::simulate_record(file.rig, file.simulation, 12);
    double fastest = 0;
    for (const double speed : record.column(record::Channel::load_velocity))
      fastest = std::max(fastest, std::fabs(speed));
    EXPECT_LT(fastest, speed_limit());
    EXPECT_GT(fastest, run.without_load ? 0 : 1e-3);
    for (const double torque : record.column(record::Channel::motor_torque))
      EXPECT_LT(std::fabs(torque), 22.5 * 110);
  }
}

TEST(YumrukcalRigs, SweepsLastAsLongAsTheirFrequencies) {
  for (const char* name : {"sine_sweep", "sine_sweep_bias"}) {
    const rig_file::RigFile file = rig("");
    const rig_file::TestRun& run = rig_file::find_test_run(file.test_runs, name);
    const double once = run.excitation.create()->period();
    EXPECT_GE(run.duration, once);
    EXPECT_LT(run.duration, once + 1);
  }
}

// One after the other both ways at 10 deg/s. The torque is the friction of Table 5.2. The motor leads by half
// the gap and by what the load's friction winds the mesh up, on either side of the start.
TEST(YumrukcalRigs, ConstantSpeedsShowFrictionAndTheWoundUpGap) {
  for (const Row& row : {kConfiguration1, kConfiguration2}) {
    rig_file::RigFile file = rig(row.model);
    double difference[2];
    for (const bool forward : {true, false}) {
      rig_file::apply_test_run(rig_file::find_test_run(file.test_runs, forward ? "constant_speed_forward"
                                                                               : "constant_speed_backward"),
                               file);
      simulation::Plant plant(file.rig, file.simulation.excitation, file.simulation.solver);
      plant.advance_to(8);
      const model::Observation o = plant.observe();
      const double friction = forward ? row.coulomb_forward + row.viscous_forward * 0.1745
                                      : -row.coulomb_backward - row.viscous_backward * 0.1745;
      EXPECT_NEAR(o.motor_velocity, forward ? 0.1745 : -0.1745, 1e-6);
      EXPECT_NEAR(o.motor_torque, friction, 1e-3);  // slow pole of the loop 3.5 1/s, for 7 s
      difference[forward] = o.motor_position - o.load_position;
    }
    const double load_friction = row.coulomb_forward - 63.0 + (row.viscous_forward - 13.7) * 0.1745 +
                                 row.coulomb_backward - 62.7 + (row.viscous_backward - 11.5) * 0.1745;
    EXPECT_NEAR(difference[1] - difference[0], row.backlash_degrees * kDegree + load_friction / row.stiffness,
                1e-7);
  }
}

/// Deepest that a flank can be pressed by a torque that was at work all the way through the gap:
/// k d^2 / 2 = T (gap + d).
double deepest(double torque, double gap, double stiffness) {
  return (torque + std::sqrt(torque * torque + 2 * stiffness * torque * gap)) / stiffness;
}

TEST(YumrukcalRigs, ExternalExcitationCrossesTheGapWithTheMotorStill) {
  rig_file::RigFile file = rig("");
  rig_file::apply_test_run(rig_file::find_test_run(file.test_runs, "external_excitation"), file);
  simulation::Plant plant(file.rig, file.simulation.excitation, file.simulation.solver);
  double lowest = 1, highest = -1;
  for (int k = 1000; k < 4000; ++k) {
    plant.advance_to(k / 100.0);
    const model::Observation o = plant.observe();
    ASSERT_EQ(o.motor_position, 0);
    lowest = std::min(lowest, o.load_position);
    highest = std::max(highest, o.load_position);
  }
  const double gap = 0.0307 * kDegree;
  EXPECT_GT(highest - lowest, gap);
  EXPECT_LT(highest - lowest,
            gap + deepest(80 + 15 - 16.8, gap, 460e3) + deepest(80 + 15 - 13.3, gap, 460e3));
}

}  // namespace
}  // namespace backlash::studies
