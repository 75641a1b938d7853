// SPDX-License-Identifier: BSD-3-Clause
// The printed configurations of Yumrukcal (2013), their test runs simulated with the sensors of the rig
// files, and each procedure's findings against the parameters that were simulated.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "identification/procedures/procedures.h"

namespace backlash::studies {
namespace {

constexpr int kSeed = 5;

std::string config(const std::string& name) {
  return std::string(BACKLASH_DIAGNOSIS_SOURCE_DIR) + "/config/" + name;
}

/// Only as long as the procedure needs; 0: as the file says.
double shortened(const std::string& run) {
  if (run == "external_excitation" || run == "square_wave") return 10;
  if (run == "inertia_sine" || run == "motor_inertia_sine") return 12;
  return 0;
}

/// Findings of all procedures but the last, from records alone and a rig file that is wrong by 20 to 40 %.
identification::IdentificationCase run_procedures(const std::string& rig_file) {
  const rig_file::RigFile file = rig_file::load_rig_file(config(rig_file));
  std::vector<record::Record> records;
  for (const rig_file::TestRun& run : file.test_runs) {
    if (run.name == "sine_sweep") continue;  // it reverses; the one with bias is preferred
    rig_file::RigFile applied = file;
    rig_file::apply_test_run(run, applied);
    applied.simulation.sensors.seed = kSeed;
    const double duration = shortened(run.name) > 0 ? shortened(run.name) : run.duration;
    records.push_back(simulation::simulate_record(applied.rig, applied.simulation, duration));
    records.back().name = run.name;
  }
  model::Rig wrong = file.rig;
  int i = 0;
  for (const rig_file::RigParameter& p : rig_file::servo_parameters()) {
    const double factors[] = {1.3, 0.75, 0.8, 1.4};
    if (p.name != "start_in_gap" && p.name != "mesh_alpha") p.set(wrong, p.get(wrong) * factors[i++ % 4]);
  }
  identification::IdentificationCase c = identification::identification_case(wrong, records);
  for (const identification::Procedure& procedure : identification::servo_procedures()) {
    if (procedure.run == identification::run_output_error) continue;
    const identification::ProcedureReport report = procedure.run(c);
    EXPECT_FALSE(report.records.empty()) << procedure.name;
    identification::update_from_findings(c);
  }
  return c;
}

const identification::IdentificationCase& found(const std::string& rig_file) {
  static std::map<std::string, identification::IdentificationCase> cases;
  const auto known = cases.find(rig_file);
  return known != cases.end() ? known->second
                              : cases.emplace(rig_file, run_procedures(rig_file)).first->second;
}

/// Goals of the closed circle, relative to the true value of what is found.
double goal(const std::string& name) {
  if (name.find("damping") != std::string::npos) return 0.10;
  const bool friction_or_gap = name.find("coulomb") != std::string::npos ||
                               name.find("viscous") != std::string::npos || name == "backlash_angle";
  return friction_or_gap ? 0.03 : 0.02;
}

class ClosedCircle : public testing::TestWithParam<const char*> {};

TEST_P(ClosedCircle, EveryProcedureFindsWhatWasSimulated) {
  const identification::IdentificationCase& c = found(GetParam());
  const model::Rig truth = model::load_side(rig_file::load_rig_file(config(GetParam())).rig);
  std::set<std::string> procedures;
  for (const identification::Finding& f : c.result.findings) {
    procedures.insert(f.procedure);
    double expected = 0;
    std::string name;
    for (const auto& [parameter, factor] : f.combination) {
      expected += factor * rig_file::servo_parameter(parameter).get(truth);
      name += " " + parameter;
    }
    const double most = goal(f.combination.begin()->first) * expected;
    // Of 17 findings one lies beyond three standard errors once in 20 runs; beyond 3.5 once in 120.
    EXPECT_NEAR(f.measured.value, expected, 3.5 * f.measured.standard_error) << f.procedure << name;
    EXPECT_NEAR(f.measured.value, expected, most) << f.procedure << name;
    EXPECT_LT(f.measured.standard_error, most / 2) << f.procedure << name;  // useful: the goal is two of them
  }
  EXPECT_EQ(procedures.size(), 6u);  // all but encoder_skew and the joint fit
  for (const auto& [name, m] : c.result.parameters) {
    const double expected = rig_file::servo_parameter(name).get(truth);
    EXPECT_NEAR(m.value, expected, 3.5 * m.standard_error) << name;
    // Differences of the directions are small against what they are differences of.
    if (name.find("asymmetry") == std::string::npos) {
      EXPECT_NEAR(m.value, expected, goal(name) * expected) << name;
    }
  }
  ASSERT_TRUE(c.result.gap_map);
  EXPECT_FALSE(c.result.gap_map->varies);
  for (const std::string& warning : c.result.warnings) ADD_FAILURE() << "nothing is wrong, but: " << warning;
}

// The last step fits all parameters at once to the raw records, with the findings as evidence.
TEST_P(ClosedCircle, OutputErrorFindsWhatWasSimulated) {
  identification::IdentificationCase c = found(GetParam());
  const model::Rig truth = model::load_side(rig_file::load_rig_file(config(GetParam())).rig);
  const identification::ProcedureReport report = identification::run_output_error(c);
  EXPECT_FALSE(report.records.empty());
  EXPECT_EQ(c.result.parameters.size(), c.names.size());
  for (const auto& [name, m] : c.result.parameters) {
    const double expected = rig_file::servo_parameter(name).get(truth);
    // Damping acts for a sample or two at each touch, which 1 kHz does not resolve.
    const double bias = name == "mesh_damping" ? 0.001 * expected : 0;
    EXPECT_NEAR(m.value, expected, 3.5 * m.standard_error + bias) << name;
    if (name == "encoder_skew") {
      EXPECT_LT(m.standard_error, 1e-5);  // s, a hundredth of a sample
    } else if (name.find("asymmetry") == std::string::npos) {
      EXPECT_NEAR(m.value, expected, goal(name) * expected) << name;
      EXPECT_LT(m.standard_error, 0.5 * goal(name) * expected) << name;
    }
  }
  for (const auto& [channel, error] : c.result.channels)
    EXPECT_LT(error.error, 1.1 * error.floor)
        << channel << ": more than the noise is left, " << report.message;
}

INSTANTIATE_TEST_SUITE_P(Yumrukcal2013, ClosedCircle,
                         testing::Values("yumrukcal_2013.yaml", "yumrukcal_2013_config1.yaml"),
                         [](const auto& info) {
                           return std::string("Configuration") + (info.index ? "1" : "2");
                         });

}  // namespace
}  // namespace backlash::studies
