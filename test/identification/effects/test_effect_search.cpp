// SPDX-License-Identifier: BSD-3-Clause
// What the model lacks, found in records of simulated machines whose truth is known. The simulation is
// another integrator than that of the search (SUNDIALS on the whole train), the effect is added in the rig
// that makes the records and left out of the rig that is declared, which is up to 30 % off in all parameters
// as well.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "backlash_diagnosis/model/term.h"
#include "support/servo.h"

namespace backlash::identification {
namespace {

struct Records {
  record::Record train, test;
};

Records records_of(const model::Rig& machine, double duration = 6) {
  Records r{simulation::simulate_record(machine, test::servo_run(11), duration),
            simulation::simulate_record(machine, test::servo_run(12), duration)};
  r.train.name = "train";
  r.test.name = "test";
  return r;
}

Trace traced(const Records& r) {
  return trace_residual(test::servo_file().rig, {r.train}, r.test);
}

std::set<std::string> found(const Trace& trace) {
  std::set<std::string> ids;
  for (const FoundEffect& e : trace.steps) ids.insert(e.id);
  return ids;
}

const signal::Measured& parameter(const Trace& trace, const std::string& effect, const std::string& name) {
  for (const FoundEffect& e : trace.steps)
    for (const EffectParameter& p : e.parameters)
      if (e.id == effect && p.name == name) return p.measured;
  throw InvalidParameter(name, effect, "not found");
}

/// Every channel ends where noise alone would leave it. 1.3: the floor is itself an estimate, and other
/// starts of the record's noise scatter it by a tenth.
void expect_at_floor(const Trace& trace) {
  for (const auto& [name, channel] : trace.channels) EXPECT_LT(channel.after, 1.3 * channel.floor) << name;
}

TEST(EffectSearch, NothingIsMissing) {
  const Trace trace = traced(records_of(test::other_servo()));
  EXPECT_EQ(trace.verdict, TraceVerdict::nothing_missing);
  EXPECT_TRUE(trace.steps.empty());
  EXPECT_FALSE(trace.unexplained);
  expect_at_floor(trace);
  // Identified with errors that hold the truth; four of them: nine parameters are tested together.
  const std::map<std::string, double> truth = {
      {"motor_inertia", 7.8}, {"load_inertia", 84}, {"motor_coulomb", 47},      {"motor_viscous", 10},
      {"load_coulomb", 18},   {"load_viscous", 7},  {"backlash_angle", 6.3e-4}, {"mesh_stiffness", 400e3}};
  for (const auto& [name, value] : truth) {
    const signal::Measured& m = trace.parameters.at(name);
    EXPECT_NEAR(m.value, value, 4 * m.standard_error + 0.003 * value) << name;
  }
}

std::shared_ptr<const model::Term> bristles(const std::string& body, double distance, double damping) {
  ParameterValues values{{"distance", distance}, {"damping", damping}};
  values.set_choice("body", body);
  return model::make_term("presliding", values);
}

// Every friction begins along some path. Of a path that hardly shows the model must know, or the rest looks
// like other effects; as long as the load turns within it, it is an effect.
TEST(EffectSearch, PreslidingIsTheShapeOfFrictionOrAnEffect) {
  model::Rig machine = test::other_servo();
  machine.terms = {bristles("load", 2e-5, 8000)};
  const Trace shape = traced(records_of(machine));
  EXPECT_EQ(shape.verdict, TraceVerdict::nothing_missing);
  EXPECT_TRUE(shape.steps.empty());
  ASSERT_EQ(shape.notes.size(), 1u);
  ASSERT_EQ(shape.augmented.terms.size(), 1u);
  EXPECT_NEAR(shape.augmented.terms[0]->values.at("damping"), 8000, 0.1 * 8000);
  expect_at_floor(shape);

  machine.terms = {bristles("motor", 1e-3, 0)};
  const Trace effect = traced(records_of(machine));
  EXPECT_EQ(found(effect), std::set<std::string>{"presliding"});
  EXPECT_NEAR(parameter(effect, "presliding", "distance").value, 1e-3, 0.05e-3);
  expect_at_floor(effect);
}

ParameterValues friction_of_motor(double torque) {
  ParameterValues values{{"torque", torque}};
  values.set_choice("body", "motor");
  return values;
}

// An offset of the torque, a twelfth of the declared dry friction, is what the zero of a current sensor
// leaves; and the load's encoder of the test record counts from another zero, as after the robot was switched
// on again.
TEST(EffectSearch, WhatEveryMachineHasIsNotedAndNotCalledMissing) {
  model::Rig machine = test::other_servo();
  machine.terms = {model::make_term("cogging", {{"amplitude", 15}, {"order", 36}, {"phase", 0.7}}),
                   model::make_term("asymmetric_coulomb", friction_of_motor(4))};
  Records records = records_of(machine);
  for (double& q : records.test.column(record::Channel::load_position)) q += 0.3;
  const Trace trace = traced(records);
  EXPECT_EQ(found(trace), std::set<std::string>{"cogging"});
  EXPECT_NEAR(parameter(trace, "cogging", "amplitude").value, 15, 0.05 * 15);
  ASSERT_EQ(trace.notes.size(), 1u);
  EXPECT_NE(trace.notes[0].find("asymmetric_coulomb, torque"), std::string::npos) << trace.notes[0];
  EXPECT_NEAR(trace.augmented.terms.back()->values.at("torque"), 4, 0.1 * 4);
  EXPECT_FALSE(trace.unexplained);
  expect_at_floor(trace);
}

// The sum of torques shows the weight and not the delay, which the simulation of the teeth does.
TEST(EffectSearch, WhatNoSumShowsIsFoundBesideWhatOneShows) {
  model::Rig machine = test::other_servo();
  machine.terms = {model::make_term("gravity", {{"amplitude", 40}, {"phase", 0.4}}),
                   model::make_term("delay", {{"delay", 1.8e-3}})};
  const Trace trace = traced(records_of(machine));
  EXPECT_EQ(found(trace), (std::set<std::string>{"gravity", "delay"}));
  EXPECT_NEAR(parameter(trace, "gravity", "amplitude").value, 40, 0.02 * 40);
  // Half a sample, by which a held torque may be misjudged, and two standard errors.
  EXPECT_NEAR(parameter(trace, "delay", "delay").value, 1.8e-3, 0.5e-3 + 2 * 0.3e-3);
  expect_at_floor(trace);
}

// A gap whose two waves the travel hardly resolves: the pressed flanks, which know no motion, show it as
// waves of other orders, and the motion of the load corrects them.
TEST(EffectSearch, AGapThatVariesSlowlyIsFoundBesideWhatASumShows) {
  model::Rig machine = test::other_servo();
  machine.terms = {
      model::make_term("asymmetric_coulomb", friction_of_motor(12)),
      model::make_term("transmission_error", {{"amplitude", 4.6e-5}, {"order", 29}, {"phase", 1.9}}),
      model::make_term("varying_backlash", {{"amplitude", 0.22}, {"order", 1}, {"phase", 2.7}}),
      model::make_term("varying_backlash", {{"amplitude", 0.1}, {"order", 4}, {"phase", 0.6}})};
  const Trace trace = traced(records_of(machine));
  EXPECT_EQ(found(trace),
            (std::set<std::string>{"asymmetric_coulomb", "transmission_error", "varying_backlash"}));
}

// Orders that the travel does not resolve are tried a quarter of a wave apart; the motion of the load shows
// which whole number near by it is.
TEST(EffectSearch, AnOrderBetweenThoseThatAreTriedIsFound) {
  model::Rig machine = test::other_servo();
  machine.terms = {model::make_term("varying_backlash", {{"amplitude", 0.3}, {"order", 5}, {"phase", 2.1}})};
  const Trace trace = traced(records_of(machine));
  EXPECT_EQ(found(trace), std::set<std::string>{"varying_backlash"});
  EXPECT_DOUBLE_EQ(parameter(trace, "varying_backlash", "order").value, 5);
  expect_at_floor(trace);
}

// Noise of the torque hides them from its sum; they are closer to Hertzian teeth than to linear ones.
TEST(EffectSearch, CubicTeethAreNoHertzianOnes) {
  model::Rig machine = test::other_servo();
  machine.terms = {
      model::make_term("mesh_hardening", {{"torque", 120}, {"penetration", 6e-4}, {"exponent", 3}})};
  Records records = records_of(machine);
  Random random(8);
  for (record::Record* record : {&records.train, &records.test})
    for (double& torque : record->column(record::Channel::motor_torque)) torque += 50 * random.normal();
  const Trace trace = traced(records);
  EXPECT_EQ(found(trace), std::set<std::string>{"mesh_hardening"});
  EXPECT_EQ(trace.augmented.mesh.contact_spec().law, "linear");
  expect_at_floor(trace);
}

/// Hertzian teeth before a spring that gives way a third as far, under 300 N m.
model::Rig hertzian_servo() {
  model::Rig machine = test::other_servo();
  machine.mesh.contact = model::make_contact_law(
      "hertz_in_series", {{"stiffness", 1.5e7}, {"series_stiffness", 1.2e6}, {"damping", 480}});
  return machine;
}

// What linear teeth leave looks like hardening, of which there is none.
TEST(EffectSearch, TeethOfAnotherShapeAreNoEffect) {
  model::Rig machine = hertzian_servo();
  machine.terms.push_back(model::make_term("gravity", {{"amplitude", 40}, {"phase", 0.4}}));
  const Trace trace = traced(records_of(machine));
  EXPECT_EQ(found(trace), std::set<std::string>{"gravity"});
  ASSERT_EQ(trace.notes.size(), 1u);
  EXPECT_EQ(trace.augmented.mesh.contact_spec().law, "hertz_in_series");
  // Errors are those of noise alone; the simulation of the fit is no finer than 1e-5.
  for (const auto& [name, value] : {std::pair{"mesh_stiffness", 1.5e7}, {"mesh_series_stiffness", 1.2e6}}) {
    const signal::Measured m = trace.parameters.at(name);
    EXPECT_NEAR(m.value, value, 4 * m.standard_error + 1e-3 * value) << name;
    EXPECT_LT(m.standard_error, 0.05 * value) << name;
  }
  expect_at_floor(trace);
  // Before: as declared, with linear teeth.
  EXPECT_GT(trace.channels.at("deflection").before, 10 * trace.channels.at("deflection").after);
  EXPECT_EQ(trace.base.mesh.contact_spec().law, "linear");
}

TEST(EffectSearch, TeethOfAnotherShapeAloneAreNoHardening) {
  const Trace trace = traced(records_of(hertzian_servo()));
  EXPECT_EQ(found(trace), std::set<std::string>{});
  EXPECT_EQ(trace.augmented.mesh.contact_spec().law, "hertz_in_series");
  expect_at_floor(trace);
}

// The rig file puts bearing and encoder on the load; they stand before a shaft that turns it.
TEST(EffectSearch, ALoadBehindAShaftIsNoEffect) {
  const model::Rig machine = test::servo_behind_shaft(0.01);
  const Trace trace = traced(records_of(machine));
  EXPECT_EQ(trace.verdict, TraceVerdict::nothing_missing);
  EXPECT_EQ(found(trace), std::set<std::string>{});
  ASSERT_EQ(trace.notes.size(), 1u);
  EXPECT_TRUE(trace.augmented.bearing_at_gear);
  // The fit's gear has no mass: a tenth.
  for (const auto& [name, value] : {std::pair{"output_stiffness", 1.2e6},
                                    {"mesh_stiffness", 400e3},
                                    {"load_inertia", 84.0},
                                    {"motor_inertia", 7.8},
                                    {"load_coulomb", 18.0}})
    EXPECT_NEAR(trace.parameters.at(name).value, value, 0.1 * value) << name;
  EXPECT_GT(trace.channels.at("deflection").before, 5 * trace.channels.at("deflection").after);
}

// All teeth lose some per cent; 15 % is more than usual.
class EffectSearchOfLoss : public testing::TestWithParam<double> {};

TEST_P(EffectSearchOfLoss, NamesItWhereItIsUnusual) {
  const double share = GetParam();
  model::Rig machine = test::other_servo();
  machine.terms.push_back(model::make_term("mesh_hysteresis", {{"share", share}, {"speed", 1e-3}}));
  const Trace trace = traced(records_of(machine));
  EXPECT_EQ(found(trace), share < 0.15 ? std::set<std::string>{} : std::set<std::string>{"mesh_hysteresis"});
  ASSERT_FALSE(trace.augmented.terms.empty());
  EXPECT_EQ(trace.augmented.terms.back()->id, "mesh_hysteresis");
  // The shape at small speeds is not resolved by the sampling: a twentieth.
  EXPECT_NEAR(trace.augmented.terms.back()->values.at("share"), share, 0.05 * share);
}

INSTANTIATE_TEST_SUITE_P(Shares, EffectSearchOfLoss, testing::Values(0.1, 0.3));

TEST(EffectSearch, TwoEffectsAtOnce) {
  model::Rig machine = test::other_servo();
  machine.terms.push_back(model::make_term("cogging", {{"amplitude", 14}, {"order", 23}, {"phase", 0.7}}));
  machine.terms.push_back(model::make_term("gravity", {{"amplitude", 40}, {"phase", 0.4}}));
  const Trace trace = traced(records_of(machine));
  EXPECT_EQ(trace.verdict, TraceVerdict::effect_found);
  EXPECT_EQ(found(trace), (std::set<std::string>{"cogging", "gravity"}));
  const signal::Measured order = parameter(trace, "cogging", "order");
  EXPECT_GT(order.standard_error, 0);
  EXPECT_NEAR(order.value, 23, 4 * order.standard_error + 0.001 * 23);
  for (const auto& [effect, value] : {std::pair{"cogging", 14.0}, {"gravity", 40.0}}) {
    const signal::Measured m = parameter(trace, effect, "amplitude");
    EXPECT_NEAR(std::fabs(m.value), value, 4 * m.standard_error + 0.003 * value) << effect;
  }
  expect_at_floor(trace);
  for (const auto& [name, channel] : trace.channels) EXPECT_LT(channel.after, channel.before) << name;
  for (const FoundEffect& e : trace.steps) {
    EXPECT_GT(e.evidence.gain_held_out, 0.03) << e.id;
    EXPECT_LT(e.test_error_after, e.test_error_before) << e.id;
  }
  // 99 % band: a hundredth of the lags outside where nothing is missing; these 51 lags are no 51 independent
  // trials, so up to a seventh.
  for (const Independence& i : trace.independence)
    EXPECT_LT(i.after, 0.15) << i.channel << " " << i.input << " before " << i.before;
}

// Whether a torque is held between samples shifts it by up to half of one; one sample is more than that.
TEST(EffectSearch, ATorqueThatIsASampleLateIsNamed) {
  model::Rig machine = test::other_servo();
  machine.terms.push_back(model::make_term("delay", {{"delay", 1.1e-3}}));
  const Trace trace = traced(records_of(machine));
  EXPECT_EQ(found(trace), std::set<std::string>{"delay"});
  const signal::Measured delay = parameter(trace, "delay", "delay");
  EXPECT_NEAR(delay.value, 1.1e-3, 2 * delay.standard_error);
  EXPECT_GT(delay.standard_error, 0.2e-3);  // s, of the hold
  expect_at_floor(trace);
}

// The motion hardly dwells at the speeds where the exponents 1 and 2 differ; only fitted do they show.
TEST(EffectSearch, TheExponentOfStribeckIsThatWhichLeavesLeast) {
  model::Rig machine = test::other_servo();
  ParameterValues values{{"torque", 25}, {"speed", 0.0255}, {"exponent", 2}};
  values.set_choice("body", "motor");
  machine.terms.push_back(model::make_term("stribeck", values));
  const Trace trace = traced(records_of(machine, 10));
  EXPECT_EQ(found(trace), std::set<std::string>{"stribeck"});
  EXPECT_EQ(parameter(trace, "stribeck", "exponent").value, 2);
  const signal::Measured torque = parameter(trace, "stribeck", "torque");
  EXPECT_NEAR(torque.value, 25, 4 * torque.standard_error);
  expect_at_floor(trace);
}

// A bump in the way of the motor, which no harmonic is.
TEST(EffectSearch, LearnsAMapOfWhatHasNoName) {
  model::Rig machine = test::other_servo();
  ParameterValues bump;
  bump.set_choice("acts_on", "motor");
  bump.set_choice("coordinate", "motor_position");
  std::vector<double> points, values;
  for (int i = -20; i <= 20; ++i) {
    points.push_back(0.05 * i);
    values.push_back(60 * std::exp(-std::pow((points.back() - 0.1) / 0.15, 2)));
  }
  bump.set_list("points", points);
  bump.set_list("values", values);
  machine.terms.push_back(model::make_term("learned_map", bump));
  const Trace trace = traced(records_of(machine, 10));
  ASSERT_EQ(found(trace), std::set<std::string>{"learned_map"});
  EXPECT_EQ(trace.steps[0].words.at("coordinate"), "motor_position");
  EXPECT_EQ(trace.steps[0].words.at("acts_on"), "motor");
  const TraceChannel& torque = trace.channels.at("torque");
  EXPECT_LT(torque.after, 0.6 * torque.before);  // the points of the map are as far apart as the bump is wide
  // Of those points a part of the bump is left over: its shape is reported, not what it is.
  EXPECT_EQ(trace.verdict == TraceVerdict::effect_found, !trace.unexplained);
}

/// A drive that gives less than it is asked for: of a recorded torque u the machine feels T0 tanh(u / T0).
record::Record with_saturation(record::Record record, double limit) {
  for (double& torque : record.column(record::Channel::motor_torque))
    torque = limit * std::atanh(torque / limit);
  return record;
}

// Only the torque itself would explain it.
TEST(EffectSearch, NeverExplainsTheTorqueByItself) {
  Records r = records_of(test::other_servo(), 10);
  double largest = 0;
  for (const record::Record* record : {&r.train, &r.test})
    for (const double torque : record->column(record::Channel::motor_torque))
      largest = std::max(largest, std::fabs(torque));
  r.train = with_saturation(r.train, 1.15 * largest);
  r.test = with_saturation(r.test, 1.15 * largest);
  const Trace trace = traced(r);
  EXPECT_TRUE(trace.unexplained);
  const TraceChannel& torque = trace.channels.at("torque");
  EXPECT_GT(torque.after, 2 * torque.floor);
  for (const FoundEffect& e : trace.steps) EXPECT_GT(e.test_gain.lower, 0) << e.id;
}

/// Noise of first order beneath 3 Hz, a twentieth of the usual torque.
record::Record with_coloured_noise(record::Record record, std::uint64_t seed) {
  Random random(seed);
  std::vector<double>& torque = record.column(record::Channel::motor_torque);
  double square = 0, noise = 0;
  for (const double value : torque) square += value * value / double(torque.size());
  const double memory = std::exp(-2 * M_PI * 3 * (record.time[1] - record.time[0]));
  for (double& value : torque) {
    noise = memory * noise + std::sqrt(1 - memory * memory) * random.normal();
    value += 0.05 * std::sqrt(square) * noise;
  }
  return record;
}

// The floor of the sensors' noise is white; what is left here is far above it, and nothing is missing.
TEST(EffectSearch, NoiseOfAnotherColourIsNoEffect) {
  Records r = records_of(test::other_servo());
  r.train = with_coloured_noise(r.train, 1);
  r.test = with_coloured_noise(r.test, 2);
  const Trace trace = traced(r);
  EXPECT_TRUE(trace.steps.empty());
  EXPECT_GT(trace.channels.at("torque").after, 2 * trace.channels.at("torque").floor);
  EXPECT_FALSE(trace.unexplained) << trace.unexplained->signature;
  EXPECT_EQ(trace.verdict, TraceVerdict::nothing_missing);
  EXPECT_FALSE(trace.notes.empty());
}

TEST(EffectSearch, SaysWhenItCannotNameWhatIsMissing) {
  // A coupling that slips now and then: the load encoder is ahead by more and more. Named effects and a map
  // are taken in on the way and must go again.
  Records r = records_of(test::other_servo(), 4);
  for (record::Record* record : {&r.train, &r.test}) {
    double slipped = 0;
    std::size_t last = 0;
    for (std::size_t k = 0; k < record->size(); ++k) {
      if (k > last + 400 && record->column(record::Channel::motor_torque)[k] > 450)
        slipped += 1.5e-4, last = k;
      record->column(record::Channel::load_position)[k] += slipped;
    }
  }
  const Trace trace = traced(r);
  EXPECT_EQ(trace.verdict, TraceVerdict::unexplained);
  ASSERT_TRUE(trace.unexplained);
  EXPECT_EQ(trace.unexplained->channel, "deflection");
  EXPECT_GT(trace.unexplained->explainable.value, 0.1);
  for (const auto& [name, channel] : trace.channels) EXPECT_LE(channel.after, 1.005 * channel.before) << name;
}

TEST(EffectSearch, IsTheSameEveryTime) {
  model::Rig machine = test::other_servo();
  machine.terms.push_back(model::make_term("gravity", {{"amplitude", 40}, {"phase", 0.4}}));
  const Records r = records_of(machine);
  const Trace a = traced(r), b = traced(r);
  EXPECT_EQ(a.channels.at("torque").after, b.channels.at("torque").after);
  EXPECT_EQ(parameter(a, "gravity", "amplitude").value, parameter(b, "gravity", "amplitude").value);
}

// A drive that pushes a little: what comes out below 0 is held at 0, where a rig file can be written.
TEST(EffectSearch, FrictionIsNeverNegative) {
  model::Rig machine = test::other_servo();
  machine.link.viscous_damping = -6;
  const Trace trace = traced(records_of(machine));
  EXPECT_LT(trace.base_parameters.at("load_viscous").value, 0);
  EXPECT_EQ(trace.parameters.at("load_viscous").value, 0);
  EXPECT_EQ(trace.augmented.link.viscous_damping, 0);
}

/// A coupled machine of this stiffness, 10 s; its deflection also follows the torque by 1 / `by_coupling`.
record::Record coupled_record(double stiffness, double by_coupling, std::uint64_t seed) {
  rig_file::RigFile file = rig_file::load_rig_file(test::package_file("config/kr300.yaml"));
  file.rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", stiffness}, {"damping", 1e4}});
  file.simulation.sensors.seed = seed;
  file.simulation.excitation.frequency += 0.1 * double(seed);
  record::Record record = simulation::simulate_record(file.rig, file.simulation, 10);
  for (std::size_t k = 0; k < record.size(); ++k)
    record.column(record::Channel::load_position)[k] -=
        record.column(record::Channel::motor_torque)[k] / by_coupling;
  return record;
}

// In one record another axis bends the structure as this one's torque goes, in the next it does not.
TEST(EffectSearch, ACoupledMachineHasNoComplianceThatTheUnseenRecordContradicts) {
  const model::Rig declared = rig_file::load_rig_file(test::package_file("config/kr300.yaml")).rig;
  const double stiff = 1e9;
  const Trace wrong =
      trace_residual(declared, {coupled_record(stiff, 8e6, 1)}, coupled_record(stiff, INFINITY, 2));
  EXPECT_LT(wrong.base_parameters.at("mesh_stiffness").value, 1.5e7);
  EXPECT_GT(wrong.parameters.at("mesh_stiffness").value, 1e8);
  EXPECT_TRUE(std::isnan(wrong.parameters.at("mesh_stiffness").standard_error));
  EXPECT_LT(wrong.channels.at("deflection").after, 0.5 * wrong.channels.at("deflection").before);
  // One that both records have stays.
  const Trace right =
      trace_residual(declared, {coupled_record(1.2e7, INFINITY, 1)}, coupled_record(1.2e7, INFINITY, 2));
  EXPECT_NEAR(right.parameters.at("mesh_stiffness").value / 1.2e7, 1, 0.05);
}

TEST(EffectSearch, RefusesRecordsThatDoNotShowTheMachine) {
  const model::Rig rig = test::servo_file().rig;
  const record::Record record = simulation::simulate_record(rig, test::servo_run(11), 3),
                       unseen = simulation::simulate_record(rig, test::servo_run(12), 3);
  EXPECT_THROW(trace_residual(rig, {}, unseen), CannotIdentify);
  EXPECT_THROW(trace_residual(rig, {unseen, record}, record), CannotIdentify);  // it is not unseen
  record::Record without_load = record;
  without_load.column(record::Channel::load_position).clear();
  EXPECT_THROW(trace_residual(rig, {without_load}, unseen), CannotIdentify);
  record::Record standing = record;
  for (double& position : standing.column(record::Channel::load_position)) position = 0.1;
  EXPECT_THROW(trace_residual(rig, {standing}, unseen), CannotIdentify);
}

TEST(EffectSearch, RecordsOfTwoRatesAreOfOneMachine) {
  const model::Rig rig = test::servo_file().rig;
  simulation::SimulationSettings faster = test::servo_run(12);
  faster.sensors.sampling_rate *= 2;
  const Trace trace = trace_residual(rig, {simulation::simulate_record(rig, test::servo_run(11), 3)},
                                     simulation::simulate_record(rig, faster, 3));
  EXPECT_EQ(trace.verdict, TraceVerdict::nothing_missing);
}

TEST(EffectSearch, CanBeStopped) {
  const model::Rig rig = test::servo_file().rig;
  const auto record = [&](std::uint64_t seed) {
    return simulation::simulate_record(rig, test::servo_run(seed), 3);
  };
  EXPECT_THROW(
      trace_residual(rig, {record(11)}, record(12), {}, [](double, const std::string&) { return false; }),
      Cancelled);
}

}  // namespace
}  // namespace backlash::identification
