// SPDX-License-Identifier: BSD-3-Clause
// A prediction never reads the signal that it predicts: with any other torque in the record, what the model
// says of torque and deflection is the same to the last bit, whatever terms it has.
#include <gtest/gtest.h>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/model/term.h"
#include "identification/effects/candidates.h"
#include "identification/effects/traced_records.h"
#include "identification/effects/unseen_record.h"
#include "support/servo.h"

namespace backlash::identification {
namespace {

constexpr double kUsualTorque = 250;  // N m, of the training records

ParameterValues clear_values(const model::TermType& type, const model::MotionRange& range) {
  ParameterValues values;
  for (const ParameterSpec& spec : type.parameters)
    if (!spec.choices.empty()) values.set_choice(spec.name, spec.choices.front());
  const model::TermSearch& search = *type.search;
  values[search.strength] = 0.2 * search.typical(range);
  if (!search.phase.empty()) values[search.phase] = 0.3;
  for (const model::TermShape& shape : search.shapes) values[shape.name] = shape.values(range).back();
  return values;
}

std::vector<std::pair<std::string, ParameterValues>> not_sought() {
  ParameterValues map;
  map.set_list("positions", {-1, 0, 1});
  map.set_list("backlash", {6e-4, 5e-4, 7e-4});
  map.set_list("centre", {0, 1e-5, 0});
  return {
      {"backlash_map", map},
      {"eccentricity",
       {{"eccentricity", 1e-5}, {"base_radius", 1}, {"pressure_angle", 0.3}, {"order", 3}, {"phase", 0.2}}},
      {"radial_compliance", {{"compliance", 1e-10}, {"base_radius", 1}, {"pressure_angle", 0.3}}}};
}

std::vector<ParameterValues> learned(const model::TermMap& map, const model::MotionRange& range,
                                     bool load_moves) {
  std::vector<ParameterValues> all;
  for (const model::MapKind& kind : map.kinds) {
    if (kind.needs_load && !load_moves) continue;
    ParameterValues values;
    values.set_choice(map.acts_on, kind.acts_on);
    values.set_choice(map.coordinate, kind.coordinate);
    values.set_list(map.points, {-1, 0, 1});
    values.set_list(map.values, {0.1 * kind.typical(range), 0, 0.05 * kind.typical(range)});
    all.push_back(values);
  }
  return all;
}

std::vector<std::shared_ptr<const model::Term>> every_term(const model::MotionRange& range, bool load_moves) {
  std::vector<std::shared_ptr<const model::Term>> all;
  for (const model::TermType& type : model::term_types()) {
    if (type.search) all.push_back(model::make_term(type.id, clear_values(type, range)));
    if (!type.map) continue;
    for (const ParameterValues& values : learned(*type.map, range, load_moves))
      all.push_back(model::make_term(type.id, values));
  }
  for (const auto& [id, values] : not_sought()) all.push_back(model::make_term(id, values));
  return all;
}

ServoPrediction prediction(const model::Rig& rig, const record::Record& record) {
  const ServoData data = traced_data(record, rig, kUsualTorque);
  Machine machine;
  machine.rig = rig;
  machine.calibrations.resize(1);
  FitSettings settings;
  settings.cutoff = 60, settings.rough_cutoff = 15, settings.feedback = 50;
  return predicted(machine, data, settings);
}

void expect_no_torque_read(model::Rig rig, const record::Record& record) {
  record::Record other = record;
  Random random(3);
  for (double& torque : other.column(record::Channel::motor_torque)) torque = 400 * random.normal();
  const model::MotionRange range = motion_range({traced_data(record, rig, kUsualTorque)});
  std::size_t count = 0;
  rig.terms.push_back(nullptr);
  for (const auto& term : every_term(range, !rig.mesh.rigid)) {
    rig.terms.back() = term;
    const ServoPrediction a = prediction(rig, record), b = prediction(rig, other);
    EXPECT_EQ(a.torque, b.torque) << term->id;
    EXPECT_EQ(a.deflection, b.deflection) << term->id;
    EXPECT_EQ(a.counts, b.counts) << term->id;
    ++count;
  }
  EXPECT_GE(count, model::term_types().size());
}

TEST(Prediction, OfTwoInertiasReadsNoTorque) {
  expect_no_torque_read(test::other_servo(),
                        simulation::simulate_record(test::other_servo(), test::servo_run(11), 1));
}

TEST(Prediction, OfOneInertiaReadsNoTorque) {
  model::Rig rig = test::other_servo();
  rig.mesh.rigid = true;
  expect_no_torque_read(rig, simulation::simulate_record(rig, test::servo_run(11), 1));
}

}  // namespace
}  // namespace backlash::identification
