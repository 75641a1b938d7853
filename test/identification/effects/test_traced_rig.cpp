// SPDX-License-Identifier: BSD-3-Clause
// The augmented rig file: what is written is what was found, and can be simulated.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <regex>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/identification/effects/traced_rig.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "support/data.h"

namespace backlash::identification {
namespace {

constexpr double kWritten = 1e-5;  // relative, of a value written with six digits

std::string config(const std::string& name) {
  std::ifstream in(test::package_file("config/" + name + ".yaml"));
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string replaced(const std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.substr(0, at) + to + text.substr(at + from.size());
}

/// A trace that found all that the rig declares 3 % larger, and the terms.
Trace found(const model::Rig& declared, const std::vector<std::string>& names,
            const std::vector<std::shared_ptr<const model::Term>>& terms) {
  Trace trace;
  trace.augmented = model::load_side(declared);
  for (const std::string& name : names) {
    const rig_file::RigParameter& p = rig_file::servo_parameter(name);
    p.set(trace.augmented, 1.03 * p.get(trace.augmented));
    trace.parameters[name] = {p.get(trace.augmented), 0.01 * p.get(trace.augmented)};
    trace.units[name] = p.unit;
  }
  for (const auto& term : terms) trace.augmented.terms.push_back(term);
  return trace;
}

const std::vector<std::string> kServo = {"motor_inertia", "load_inertia",   "mesh_stiffness",
                                         "mesh_damping",  "backlash_angle", "motor_coulomb",
                                         "motor_viscous", "load_coulomb",   "load_viscous"};

std::shared_ptr<const model::Term> gravity() {
  return model::make_term("gravity", {{"amplitude", 12.5}, {"phase", 0.3}});
}

std::shared_ptr<const model::Term> learned() {
  ParameterValues values;
  values.set_choice("acts_on", "motor");
  values.set_choice("coordinate", "motor_velocity");
  values.set_list("points", {-100, 0, 100});
  values.set_list("values", {3, 0, -2});
  return model::make_term("learned_map", values);
}

std::vector<std::string> ids(const model::Rig& rig) {
  std::vector<std::string> all;
  for (const auto& term : rig.terms) all.push_back(term->id);
  return all;
}

/// Writes, reads, compares with the trace and simulates.
rig_file::RigFile round_trip(const std::string& text, const std::vector<std::string>& names,
                             const std::vector<std::shared_ptr<const model::Term>>& terms) {
  const rig_file::RigFile declared = rig_file::rig_file_from_text(text, "rig.yaml");
  const Trace trace = found(declared.rig, names, terms);
  const std::string written = traced_rig_text(declared, trace);
  const rig_file::RigFile file = rig_file::rig_file_from_text(written, "rig.yaml");
  const model::Rig rig = model::load_side(file.rig);
  for (const std::string& name : names) {
    const double expected = rig_file::servo_parameter(name).get(trace.augmented);
    EXPECT_NEAR(rig_file::servo_parameter(name).get(rig) / expected, 1, kWritten) << name << "\n" << written;
  }
  EXPECT_EQ(ids(rig), ids(trace.augmented)) << written;
  const record::Record record = simulation::simulate_record(file.rig, file.simulation, 0.1);
  EXPECT_EQ(record.size(), std::size_t(std::lround(0.1 * file.simulation.sensors.sampling_rate)));
  return file;
}

TEST(TracedRig, OfAServoHoldsMachineAndTerms) {
  const rig_file::RigFile file = round_trip(config("two_inertia_servo"), kServo, {gravity(), learned()});
  EXPECT_EQ(file.rig.terms[0]->values.at("amplitude"), 12.5);
  EXPECT_EQ(file.rig.terms[1]->values.list("values"), (std::vector<double>{3, 0, -2}));
  EXPECT_EQ(file.text.find("# Geared servo with two inertias"), 0u);  // comments stay
  EXPECT_NE(file.text.find("inertia: 6.489                # kg m^2, fitted +- 0.065"), std::string::npos)
      << file.text;
}

TEST(TracedRig, OfTheMotorSideIsWrittenInItsUnitsAndItsTermsAreNot) {
  // The motor of the servo as its shaft sees it, ratio 110.
  std::string text = replaced(config("two_inertia_servo"), "reduction_ratio: 110 ",
                              "motor_side: true\n  reduction_ratio: 110 ");
  text = replaced(text, "inertia: 6.3 ", "inertia: 5.2066e-4 ");
  text = replaced(text, "viscous_damping: 13 ", "viscous_damping: 1.0744e-3 ");
  text = replaced(text, "coulomb_friction: 63 ", "coulomb_friction: 0.57273 ");
  text = replaced(text, "amplitude: 400 ", "amplitude: 3.64 ");
  const rig_file::RigFile file = round_trip(text, kServo, {gravity()});
  EXPECT_NEAR(file.rig.motor.inertia, 1.03 * 5.2066e-4, 1e-5 * 5.2066e-4);
  EXPECT_NEAR(file.rig.motor.coulomb_friction, 1.03 * 0.57273, 1e-5);
  EXPECT_EQ(file.rig.terms[0]->values.at("amplitude"), 12.5);
  EXPECT_NE(file.text.find("fitted +- 5.4e-06"), std::string::npos) << file.text;  // of the shaft, 1 % of it
}

TEST(TracedRig, OfOneInertiaAndOfALockedLink) {
  const auto asymmetric = [](const char* id, const char* parameter) {
    ParameterValues values = {{parameter, 0.7}};
    values.set_choice("body", "motor");
    return model::make_term(id, values);
  };
  const rig_file::RigFile emps = round_trip(
      config("emps"), {"motor_inertia", "motor_coulomb", "motor_coulomb_asymmetry", "motor_viscous"},
      {asymmetric("asymmetric_viscous", "damping"), gravity()});
  EXPECT_NE(emps.text.find("damping: 0.7  # N s/m"), std::string::npos) << emps.text;
  EXPECT_NE(emps.text.find("# kg, fitted"), std::string::npos) << emps.text;
  round_trip(config("cycloidal"),
             {"motor_inertia", "mesh_stiffness", "mesh_damping", "backlash_angle", "motor_viscous"},
             {asymmetric("asymmetric_coulomb", "torque"), learned()});
}

TEST(TracedRig, OtherTeethReplaceTheDeclaredLaw) {
  const rig_file::RigFile declared = rig_file::rig_file_from_text(config("two_inertia_servo"), "rig.yaml");
  Trace trace = found(declared.rig, kServo, {gravity()});
  trace.augmented.mesh.contact =
      model::make_contact_law("hunt_crossley", {{"stiffness", 2.1e7}, {"exponent", 1.5}, {"alpha", 0.8}});
  trace.parameters.erase("mesh_damping");
  trace.parameters["mesh_stiffness"] = {2.1e7, 1e5};
  trace.parameters["mesh_alpha"] = {0.8, 0.01};
  trace.units["mesh_alpha"] = "s/rad";
  const rig_file::RigFile file = rig_file::rig_file_from_text(traced_rig_text(declared, trace), "rig.yaml");
  EXPECT_EQ(file.rig.mesh.contact_spec().law, "hunt_crossley");
  EXPECT_EQ(file.rig.mesh.contact_spec().values, trace.augmented.mesh.contact_spec().values);
  EXPECT_EQ(file.text.find("damping: 483"), std::string::npos) << file.text;
  EXPECT_NE(file.text.find("# N m/rad^1.5, fitted +- 1e+05"), std::string::npos) << file.text;
  EXPECT_NE(file.text.find("# s/rad, fitted +- 0.01"), std::string::npos) << file.text;
  EXPECT_EQ(simulation::simulate_record(file.rig, file.simulation, 0.1).size(), 100u);
}

TEST(TracedRig, DeclaredTermsStayAsTheyAre) {
  const std::string servo = config("two_inertia_servo");
  const std::string declared = "  amplitude: 4.0   # N m, of the spring\n", tail = "\n# the end\n";
  const std::vector<std::string> spellings = {
      "\nterms:\n- id: cogging\n  order: 7\n  phase: 0\n" + declared + tail,
      "\nterms:  # two\n    -\n      id: gravity\n      amplitude: 1\n      phase: 0\n    # here\n    - id: "
      "cogging\n"
      "      order: 7\n      phase: 0\n    " +
          declared + tail};
  for (const std::string& terms : spellings) {
    // In the middle of the file and at its end.
    for (const std::string& text :
         {servo + terms, replaced(servo, "\nexcitation:", terms + "\nexcitation:")}) {
      const rig_file::RigFile file = round_trip(text, kServo, {gravity(), learned()});
      EXPECT_NE(file.text.find(declared), std::string::npos) << file.text;
      EXPECT_NE(file.text.find(tail), std::string::npos) << file.text;
      EXPECT_EQ(ids(file.rig).back(), "learned_map");
    }
  }
  round_trip(servo + "terms: []  # none\n", kServo, {gravity()});
}

TEST(TracedRig, WithoutEffectsHasNoTerms) {
  const rig_file::RigFile declared = rig_file::rig_file_from_text(config("two_inertia_servo"), "rig.yaml");
  EXPECT_EQ(traced_rig_text(declared, found(declared.rig, {}, {})), declared.text);
}

TEST(TracedRig, FindsTheTestRunsFromAnotherFolder) {
  const rig_file::RigFile declared =
      rig_file::load_rig_file(test::package_file("config/yumrukcal_2013.yaml"));
  const std::string text = traced_rig_text(declared, found(declared.rig, {}, {gravity()}));
  EXPECT_EQ(rig_file::rig_file_from_text(text, "/somewhere/else/rig.yaml").test_runs.size(),
            declared.test_runs.size());
  EXPECT_GT(declared.test_runs.size(), 0u);
}

TEST(TracedRig, RefusesBeforehandWhatItCannotWrite) {
  for (const char* name :
       {"two_inertia_servo", "emps", "cycloidal", "yumrukcal_2013", "yumrukcal_2013_varying"})
    EXPECT_NO_THROW(check_traced_rig_text(
        rig_file::load_rig_file(test::package_file("config/" + std::string(name) + ".yaml"))))
        << name;
  const std::string servo = config("two_inertia_servo");
  const std::string contact =
      std::regex_replace(servo, std::regex("    contact:\n(      .*\n)+"),
                         "    contact: {law: linear, stiffness: 460e3, damping: 483}\n");
  EXPECT_NE(contact, servo);
  EXPECT_NO_THROW(check_traced_rig_text(rig_file::rig_file_from_text(contact, "rig.yaml")));
}

// As people write it.
TEST(TracedRig, TakesMapsAndListsInBrackets) {
  std::string text =
      config("two_inertia_servo") + "terms: [{id: gravity, amplitude: 1, phase: 0}]  # of the arm\n";
  text = std::regex_replace(text, std::regex("    contact:.*\n(      .*\n)+"),
                            "    contact: {law: linear, stiffness: 460e3, damping: 483}  # teeth\n");
  text = std::regex_replace(text, std::regex("  motor:.*\n(    .*\n)+"),
                            "  motor: {inertia: 6.3, viscous_damping: 13, coulomb_friction: 63}\n");
  EXPECT_NE(text.find("  motor: {"), std::string::npos);
  EXPECT_NE(text.find("contact: {"), std::string::npos);
  const rig_file::RigFile file = round_trip(text, kServo, {gravity(), learned()});
  EXPECT_NE(file.text.find("\n  - {id: gravity, amplitude: 1, phase: 0}\n"), std::string::npos) << file.text;

  const rig_file::RigFile declared = rig_file::rig_file_from_text(text, "rig.yaml");
  Trace trace = found(declared.rig, {"mesh_stiffness"}, {});
  trace.augmented.mesh.contact =
      model::make_contact_law("hunt_crossley", {{"stiffness", 2.1e7}, {"exponent", 1.5}, {"alpha", 0.8}});
  const rig_file::RigFile hertz = rig_file::rig_file_from_text(traced_rig_text(declared, trace), "rig.yaml");
  EXPECT_EQ(hertz.rig.mesh.contact_spec().values, trace.augmented.mesh.contact_spec().values);
}

TEST(TracedRig, WritesAShaftBeforeTheLoad) {
  const rig_file::RigFile declared = rig_file::rig_file_from_text(config("two_inertia_servo"), "rig.yaml");
  Trace trace = found(declared.rig, {"mesh_stiffness"}, {});
  trace.augmented.output_coupling = {false, 1.3e6, 0, 0};
  trace.augmented.bearing_at_gear = true;
  trace.augmented.gear.inertia = 0.4;
  trace.parameters["output_stiffness"] = {1.3e6, 2e4};
  trace.units["output_stiffness"] = "N m/rad";
  const model::Rig rig = rig_file::rig_file_from_text(traced_rig_text(declared, trace), "rig.yaml").rig;
  EXPECT_TRUE(rig.output_coupling == trace.augmented.output_coupling);
  EXPECT_TRUE(rig.bearing_at_gear);
  EXPECT_EQ(rig.gear.inertia, 0.4);
}

}  // namespace
}  // namespace backlash::identification
