// SPDX-License-Identifier: BSD-3-Clause
// All terms of the registry: what the search for missing effects may try of each, and that nothing of it is
// nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/model/term_text.h"

namespace backlash::model {
namespace {

/// As the records of a servo of the size of the rig below.
MotionRange servo_range() {
  MotionRange range;
  range.torque = 200;
  range.speed = 0.43;
  range.deflection = 6e-4;
  range.from = -1.3;
  range.to = 0.4;
  range.duration = 30;
  range.interval = 1e-3;
  return range;
}

Rig servo(std::shared_ptr<const Term> term = nullptr) {
  Rig rig;
  rig.motor.inertia = 6.3;
  rig.motor.coulomb_friction = 63;
  rig.motor.viscous_damping = 13;
  rig.link.inertia = 108;
  rig.link.coulomb_friction = 15;
  rig.link.viscous_damping = 9;
  rig.mesh.backlash = 5.4e-4;
  rig.mesh.contact = make_contact_law("linear", {{"stiffness", 460e3}, {"damping", 483}});
  if (term) rig.terms = {std::move(term)};
  return rig;
}

using Visit = std::function<void(const ParameterValues&)>;

void each_shape(const TermSearch& search, std::size_t i, ParameterValues& values, const Visit& visit) {
  if (i == search.shapes.size()) return visit(values);
  for (const double value : search.shapes[i].values(servo_range())) {
    values[search.shapes[i].name] = value;
    each_shape(search, i + 1, values, visit);
  }
}

void each_choice(const TermType& type, std::size_t i, ParameterValues& values, const Visit& visit) {
  if (i == type.parameters.size()) return each_shape(*type.search, 0, values, visit);
  const ParameterSpec& spec = type.parameters[i];
  if (spec.choices.empty()) return each_choice(type, i + 1, values, visit);
  for (const std::string& word : spec.choices) {
    values.set_choice(spec.name, word);
    each_choice(type, i + 1, values, visit);
  }
}

/// Each combination of choices and shapes, without effect and with its strength at phase 0.4.
void each_combination(const TermType& type, const Visit& visit) {
  ParameterValues values;
  if (!type.search->phase.empty()) values[type.search->phase] = 0.4;
  each_choice(type, 0, values, visit);
}

const double kStates[][4] = {{-0.7, -0.7001, 0.2, 0.21},
                             {-0.2, -0.2006, 0.003, 0.0028},
                             {0.3, 0.3008, -0.4, -0.39},
                             {-1.1, -1.1004, -0.02, 0.01},
                             {0.1, 0.1, 0, 0},
                             {-0.5, -0.5009, 0.7, 0.71},
                             {-1.29, -1.2894, 0.4, 0.39},
                             {0.39, 0.3896, -0.3, -0.31}};

std::vector<GearTrain::EndForces> forces(const Rig& rig) {
  const GearTrain train(rig);
  std::vector<GearTrain::EndForces> all;
  double t = 0;
  for (const auto& state : kStates) all.push_back(train.end_forces(t += 3, state, 150.0));
  return all;
}

/// Largest differences of all that moves the motor, and of all that moves the load.
struct Change {
  double motor = 0, load = 0;
};

Change change(const std::vector<GearTrain::EndForces>& a, const std::vector<GearTrain::EndForces>& b) {
  Change most;
  const auto raise = [](double& to, double x, double y) { to = std::max(to, std::fabs(x - y)); };
  for (std::size_t i = 0; i < a.size(); ++i) {
    raise(most.motor, a[i].motor, b[i].motor);
    raise(most.motor, a[i].friction.motor.forward, b[i].friction.motor.forward);
    raise(most.motor, a[i].friction.motor.backward, b[i].friction.motor.backward);
    raise(most.load, a[i].load, b[i].load);
    raise(most.load, a[i].mesh_torque, b[i].mesh_torque);
    raise(most.load, a[i].friction.load.forward, b[i].friction.load.forward);
    raise(most.load, a[i].friction.load.backward, b[i].friction.load.backward);
  }
  return most;
}

TEST(TermSearches, AccountForEveryParameter) {
  for (const TermType& type : term_types()) {
    if (!type.search) continue;
    std::set<std::string> set = {type.search->strength};
    if (!type.search->phase.empty()) {
      EXPECT_TRUE(set.insert(type.search->phase).second) << type.id;
    }
    for (const TermShape& shape : type.search->shapes) EXPECT_TRUE(set.insert(shape.name).second) << type.id;
    for (const ParameterSpec& spec : type.parameters) {
      EXPECT_FALSE(spec.list) << type.id;
      if (spec.choices.empty()) {
        EXPECT_EQ(set.erase(spec.name), 1u) << type.id << "." << spec.name;
      }
    }
    EXPECT_TRUE(set.empty()) << type.id << ": " << *set.begin() << " is no parameter";
    EXPECT_GT(type.search->typical(servo_range()), 0) << type.id;
  }
}

TEST(TermSearches, TryEveryEffectThatIsToBeFoundWithFewCombinations) {
  std::set<std::string> sought;
  for (const TermType& type : term_types()) {
    if (!type.search) continue;
    sought.insert(type.id);
    int count = 0;
    each_combination(type, [&](const ParameterValues&) { ++count; });
    EXPECT_GE(count, 1) << type.id;
    EXPECT_LE(count, 250) << type.id;
  }
  for (const char* id :
       {"asymmetric_coulomb", "asymmetric_viscous", "backlash", "cogging", "friction_drift", "gravity",
        "load_dependent_friction", "local_fault", "mesh_hardening", "mesh_hysteresis",
        "position_dependent_friction", "quadratic_drag", "square_root_friction", "stribeck",
        "transmission_error", "varying_backlash", "varying_reduction_ratio"})
    EXPECT_EQ(sought.count(id), 1u) << id;
}

// Rounding alone: where flanks are shaped the mesh torque, 300 N m, comes from other sums.
TEST(TermSearches, AStrengthOfZeroIsNoEffect) {
  const auto without = forces(servo());
  for (const TermType& type : term_types())
    if (type.search)
      each_combination(type, [&](ParameterValues values) {
        values[type.search->strength] = 0;
        const Change none = change(forces(servo(make_term(type.id, values))), without);
        EXPECT_LE(std::max(none.motor, none.load), 1e-9) << type.id;
      });
}

TEST(TermSearches, TheTypicalStrengthShowsAndOnlyWhereTheTermSays) {
  const auto without = forces(servo());
  for (const TermType& type : term_types()) {
    if (!type.search) continue;
    double most = 0;
    bool senses = false;
    each_combination(type, [&](ParameterValues values) {
      values[type.search->strength] = type.search->typical(servo_range());
      const auto term = make_term(type.id, values);
      const Change shown = change(forces(servo(term)), without);
      most = std::max({most, shown.motor, shown.load});
      if (!term->moves_load()) {
        EXPECT_EQ(shown.load, 0) << term_text(*term);
      }
      Sensing sensing;
      term->sense(sensing);
      senses |= sensing.load_position_gain != 1 || sensing.torque_delay != 0;
    });
    if (!senses && type.id != "presliding") {
      EXPECT_GT(most, 1) << type.id;  // N m, the noise of such a servo
    }
  }
}

std::shared_ptr<const Term> reread(const Term& term) {
  const YamlReader yaml = YamlReader::from_text("terms:\n" + term_text(term), "rig.yaml");
  const auto back = read_term(yaml.maps("terms").at(0));
  yaml.finish();
  return back;
}

void expect_same(const Term& a, const Term& b) {
  ASSERT_EQ(a.id, b.id);
  for (const ParameterSpec& spec : term_type(a.id).parameters) {
    if (!spec.choices.empty())
      EXPECT_EQ(a.values.choice(spec.name), b.values.choice(spec.name)) << a.id;
    else if (spec.list)
      EXPECT_EQ(a.values.list(spec.name), b.values.list(spec.name)) << a.id;
    else
      EXPECT_EQ(a.values.at(spec.name), b.values.at(spec.name)) << a.id << "." << spec.name;
  }
}

TEST(TermText, ReadsBackToTheLastDigit) {
  for (const TermType& type : term_types()) {
    if (!type.search) continue;
    each_combination(type, [&](ParameterValues values) {
      values[type.search->strength] = type.search->typical(servo_range()) / 3;
      const auto term = make_term(type.id, values);
      expect_same(*term, *reread(*term));
    });
  }
}

TEST(TermText, WritesListsAndTinyNumbers) {
  ParameterValues values;
  values.set_list("positions", {-1.0 / 3, 0, 1e-300, 2.5});
  values.set_list("backlash", {1e22, 0.1, 2e-5, 1.0 / 7});
  values.set_list("centre", {-1e-17, 0, 3, 4});
  const auto map = make_term("backlash_map", values);
  expect_same(*map, *reread(*map));
}

TEST(TermText, IsAnEntryInBlockStyle) {
  const auto gravity = make_term("gravity", {{"amplitude", 2.5}, {"phase", -0.25}});
  EXPECT_EQ(term_text(*gravity), "  - id: gravity\n    amplitude: 2.5  # N m\n    phase: -0.25  # rad\n");
  ParameterValues values{{"torque", 1e-7}};
  values.set_choice("body", "load");
  EXPECT_EQ(term_text(*make_term("asymmetric_coulomb", values)),
            "  - id: asymmetric_coulomb\n    body: load\n    torque: 1e-07  # N m\n");
}

TEST(TermText, EntriesFollowEachOtherInAFile) {
  const auto gravity = make_term("gravity", {{"amplitude", 2.5}, {"phase", -0.25}});
  const auto error = make_term("transmission_error", {{"amplitude", 1e-5}, {"order", 19}, {"phase", 6}});
  const YamlReader yaml =
      YamlReader::from_text("terms:\n" + term_text(*gravity) + term_text(*error), "rig.yaml");
  const auto entries = yaml.maps("terms");
  ASSERT_EQ(entries.size(), 2u);
  expect_same(*read_term(entries[0]), *gravity);
  expect_same(*read_term(entries[1]), *error);
}

}  // namespace
}  // namespace backlash::model
