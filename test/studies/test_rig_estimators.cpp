// SPDX-License-Identifier: BSD-3-Clause
// Estimators of play that need no monitoring curve, on simulated rigs and on records of a separate program.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/diagnosis/lost_motion.h"
#include "backlash_diagnosis/diagnosis/momentum_transfer.h"
#include "backlash_diagnosis/diagnosis/position_difference.h"
#include "backlash_diagnosis/diagnosis/waveform.h"
#include "backlash_diagnosis/model/contact_law.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "support/data.h"
#include "support/servo.h"

namespace backlash::studies {
namespace {

/// What a rig file says to the estimators.
const model::GearTrain& declared_train() {
  static const model::GearTrain train(rig_file::default_rig_file().rig);
  return train;
}

double base_radius() {
  return rig_file::default_rig_file().rig.mesh.base_radius;
}

diagnosis::PositionDifferenceSettings position_settings() {
  diagnosis::PositionDifferenceSettings s;
  s.elastic_deflection = [](double torque) { return declared_train().elastic_deflection(torque); };
  s.motor_inertia = rig_file::default_rig_file().rig.motor.inertia;
  s.base_radius = base_radius();
  return s;
}

diagnosis::MomentumTransferSettings momentum_settings() {
  const model::Rig rig = rig_file::default_rig_file().rig;
  diagnosis::MomentumTransferSettings s;
  s.motor_inertia = rig.motor.inertia;
  s.motor_damping = rig.motor.viscous_damping;
  s.pinion_inertia = rig.pinion.inertia;
  s.coupling_stiffness = rig.input_coupling.stiffness;
  s.flank_deflection = [k = s.coupling_stiffness](double torque) {
    return declared_train().elastic_deflection(torque) - torque / k;
  };
  s.output_locked = true;
  s.base_radius = base_radius();
  return s;
}

struct Case {
  double backlash = 0;  // m
  record::Record record;
};

/// The Sarkar rig with a random half gap, noise and seed; its stiffness differs from the declared one by the
/// declared uncertainty (2 % at 95 %).
Case random_case(Random& random, double largest_half_gap, double rate) {
  rig_file::RigFile file = rig_file::default_rig_file();
  Case c;
  c.backlash = file.rig.mesh.backlash = 2 * random.uniform(0, largest_half_gap);
  file.rig.input_coupling.stiffness *= 1 + 0.01 * random.normal();
  simulation::SensorsSettings& sensors = file.simulation.sensors;
  sensors.sampling_rate = rate;
  sensors.seed = random.bits();
  sensors.of(record::Channel::motor_torque).noise = random.uniform(0, 2e-3);
  sensors.of(record::Channel::motor_position).resolution = 1e-6;
  sensors.of(record::Channel::motor_velocity).noise = random.uniform(0, 0.02);
  c.record = simulation::simulate_record(file.rig, file.simulation, random.uniform(0.5, 1.5));
  return c;
}

struct Score {
  int answers = 0, right = 0, far = 0;
  std::map<diagnosis::Status, int> seen;
  std::vector<double> errors;
  void add(const diagnosis::Estimate& e, double truth) {
    ++seen[e.status];
    if (e.status != diagnosis::Status::ok && e.status != diagnosis::Status::below_range) return;
    ++answers;
    const double rounding = 1e-12, width = e.upper - e.lower;
    right += e.lower <= truth + rounding && truth <= e.upper + rounding;
    far += truth < e.lower - 2 * width || truth > e.upper + 2 * width;
    errors.push_back(std::abs(e.backlash - truth));
  }
  double median_error() {
    std::sort(errors.begin(), errors.end());
    return errors[errors.size() / 2];
  }
};

// Of 60 answers 95 % intervals hold 57 in the mean, fewer than 52 with a probability of 1 %.
constexpr int kCases = 60, kFewestRight = 52;

TEST(RigEstimators, PositionDifferenceOfTheLockedRig) {
  Random random(1);
  Score score;
  for (int i = 0; i < kCases; ++i) {
    const Case c = random_case(random, 100e-6, i % 2 ? 1000 : 5000);
    score.add(diagnosis::estimate_position_difference(c.record, position_settings()), c.backlash);
  }
  EXPECT_GE(score.seen[diagnosis::Status::ok], 57);  // a gap of a few um may be below the range
  EXPECT_EQ(score.seen[diagnosis::Status::ok] + score.seen[diagnosis::Status::below_range], kCases);
  EXPECT_GE(score.right, kFewestRight);
  EXPECT_EQ(score.far, 0);
  EXPECT_LT(score.median_error(), 3e-6);
  RecordProperty("right", score.right);
}

TEST(RigEstimators, MomentumTransferOfTheLockedRig) {
  Random random(2);
  Score by_speed, by_position;
  for (int i = 0; i < kCases; ++i) {
    Case c = random_case(random, 100e-6, i % 2 ? 5000 : 10000);
    const bool tachometer = i % 4 < 2;
    c.record.column(tachometer ? record::Channel::motor_position : record::Channel::motor_velocity).clear();
    (tachometer ? by_speed : by_position)
        .add(diagnosis::estimate_momentum_transfer(c.record, momentum_settings()), c.backlash);
  }
  EXPECT_GE(by_speed.seen[diagnosis::Status::ok], 27);
  EXPECT_EQ(by_speed.answers + by_speed.seen[diagnosis::Status::out_of_domain],
            30);  // a noisy tachometer may be refused
  EXPECT_GE(by_position.seen[diagnosis::Status::ok], 28);
  EXPECT_EQ(by_position.answers, 30);
  EXPECT_GE(by_speed.right + by_position.right,
            by_speed.answers + by_position.answers - kCases + kFewestRight);
  EXPECT_EQ(by_speed.far + by_position.far, 0);
  EXPECT_LT(by_speed.median_error(), 4e-6);
  EXPECT_LT(by_position.median_error(), 4e-6);
}

/// The same rig, but every value as far off as the file leaves open.
Case unlike_case(Random& random) {
  rig_file::RigFile file = rig_file::default_rig_file();
  const diagnosis::WaveformSpread spread;
  const auto off = [&](double by) { return std::exp(by * random.normal()); };
  Case c;
  c.backlash = file.rig.mesh.backlash = 2 * random.uniform(0, 100e-6);
  file.rig.motor.inertia *= off(spread.motor_inertia);
  file.rig.motor.viscous_damping *= off(spread.motor_damping);
  file.rig.pinion.inertia *= off(spread.pinion_inertia);
  file.rig.input_coupling.stiffness *= off(spread.sensor_stiffness);
  model::ContactSpec contact = file.rig.mesh.contact_spec();
  contact.values["stiffness"] *= off(spread.contact_stiffness);
  file.rig.mesh.contact = model::make_contact_law(contact.law, contact.values);
  simulation::SensorsSettings& sensors = file.simulation.sensors;
  sensors.sampling_rate = random.uniform(0, 1) < 0.5 ? 5000 : 10000;
  sensors.seed = random.bits();
  sensors.of(record::Channel::motor_torque).noise = 1e-3;
  sensors.of(record::Channel::motor_position).resolution = 1e-6;
  c.record = simulation::simulate_record(file.rig, file.simulation, 1);
  c.record.column(record::Channel::motor_velocity).clear();
  return c;
}

// Of 38 answers 95 % intervals hold 36 in the mean, fewer than 33 with a probability of 1 %. Of the rest the
// crossings differ or the motor does not fly freely by the declared values.
TEST(RigEstimators, MomentumTransferOfARigThatIsNotTheDeclaredOne) {
  Random random(21);
  Score score, sure;
  const diagnosis::MomentumTransferSettings settings =
      *rig_file::default_rig_file().diagnosis.momentum_transfer;
  for (int i = 0; i < kCases; ++i) {
    const Case c = unlike_case(random);
    score.add(diagnosis::estimate_momentum_transfer(c.record, settings), c.backlash);
    sure.add(diagnosis::estimate_momentum_transfer(c.record, momentum_settings()), c.backlash);
  }
  EXPECT_GE(score.answers, 30);
  EXPECT_GE(score.right, score.answers - 5);
  EXPECT_EQ(score.far, 0);
  EXPECT_GT(sure.answers - sure.right, 2 * (score.answers - score.right));  // without the spread
  RecordProperty("answers", score.answers);
  RecordProperty("right", score.right);
  RecordProperty("right_without", sure.right);
}

// Of the declared rig, from a tachometer or an encoder of the motor alone: no torque is recorded.
TEST(RigEstimators, MomentumTransferFromTheMotionAlone) {
  Random random(12);
  Score by_speed, by_position;
  for (int i = 0; i < kCases; ++i) {
    Case c = random_case(random, 100e-6, i % 2 ? 5000 : 10000);
    const bool tachometer = i % 4 < 2;
    c.record.column(record::Channel::motor_torque).clear();
    c.record.column(tachometer ? record::Channel::motor_position : record::Channel::motor_velocity).clear();
    const diagnosis::Estimate e = diagnosis::estimate_momentum_transfer(c.record, momentum_settings());
    (tachometer ? by_speed : by_position).add(e, c.backlash);
  }
  EXPECT_GE(by_speed.answers, 26);  // large gaps, whose motion repeats less, may be refused
  EXPECT_GE(by_position.answers, 25);
  const int answers = by_speed.answers + by_position.answers;
  EXPECT_GE(by_speed.right + by_position.right, answers - kCases + kFewestRight);
  EXPECT_EQ(by_speed.far + by_position.far, 0);
  EXPECT_LT(by_speed.median_error(), 4e-6);
  EXPECT_LT(by_position.median_error(), 4e-6);
}

TEST(RigEstimators, MomentumTransferNeedsToSeeTheImpacts) {
  Random random(3);
  const Case slow = random_case(random, 100e-6, 1000);
  const diagnosis::Estimate e = diagnosis::estimate_momentum_transfer(slow.record, momentum_settings());
  EXPECT_EQ(e.status, diagnosis::Status::out_of_domain);
  EXPECT_NE(e.message.find("samples per cycle"), std::string::npos) << e.message;
  rig_file::RigFile file =
      rig_file::default_rig_file();  // no gap: contact is lost for no longer than the flanks spring back
  file.simulation.sensors.sampling_rate = 10000;
  EXPECT_EQ(diagnosis::estimate_momentum_transfer(simulation::simulate_record(file.rig, file.simulation, 0.6),
                                                  momentum_settings())
                .status,
            diagnosis::Status::below_range);
}

// Friction of 44 to 73 N m that the settings do not know: what leaves nothing in flight determines it, or
// there is no answer. Plays of truth.json, rad. Of the slow motions, "train", teeth that yield after Hertz
// would explain all of the travel.
TEST(RigEstimators, MomentumTransferOfServosWithUndeclaredFriction) {
  int seen = 0, answered = 0;
  for (const auto& [name, play] : {std::pair{"dev1", 5.742e-4}, {"dev3", 6.020e-4}, {"dev6", 8.633e-4}})
    for (const char* motion : {"/train.csv", "/test.csv"}) {
      const auto path = test::find_data(std::string("undeclared/") + name + motion);
      if (!path) continue;
      ++seen;
      diagnosis::MomentumTransferSettings s;
      s.motor_inertia = 6.3;
      s.motor_damping = 13;
      s.flank_deflection = [](double torque) { return torque / 460e3; };
      s.elastic_uncertainty = 0.67;  // as of a rig file whose load is free: teeth 40 % softer than declared
      const diagnosis::Estimate e = diagnosis::estimate_momentum_transfer(record::read_csv(*path), s);
      if (e.status != diagnosis::Status::ok) continue;
      ++answered;
      EXPECT_LE(e.angle_lower, play) << *path << ": " << e.message;
      EXPECT_GE(e.angle_upper, play) << *path << ": " << e.message;
    }
  if (seen == 0) GTEST_SKIP() << "no undeclared/dev*/*.csv in $BACKLASH_DIAGNOSIS_DATA or ../shared/data";
  EXPECT_GE(answered, seen / 3);
}

/// Two inertias with a free load, as they are declared for the records of the separate program.
model::Rig servo_rig(double stiffness) {
  return model::read_rig(YamlReader::from_text(
      "{name: servo, joint: servo, gear_train: {reduction_ratio: 1, motor: {inertia: 6.3, viscous_damping: "
      "13}, "
      "input_coupling: rigid, mesh: {backlash_angle: 5.4e-4, contact: {law: linear, stiffness: " +
          std::to_string(stiffness) +
          ", damping: 483}}, output_coupling: rigid, link: {inertia: 108, viscous_damping: 9}}}",
      "servo"));
}

diagnosis::PositionDifferenceSettings servo_settings() {
  diagnosis::PositionDifferenceSettings s;
  s.elastic_deflection = [](double torque) { return torque / 460e3; };
  s.elastic_uncertainty = 0.4;
  s.motor_inertia = 6.3;
  s.load_inertia = 108;
  s.load_damping = 9;
  s.load_friction = 15;
  return s;
}

TEST(RigEstimators, PositionDifferenceOfAServoWithUnknownParameters) {
  Random random(4);
  int right = 0;
  constexpr int cases = 12;
  for (int i = 0; i < cases; ++i) {
    model::Rig rig = servo_rig(460e3 * random.uniform(0.7, 1.4));
    rig.mesh.backlash = 5.4e-4 * random.uniform(0.6, 1.4);
    rig.motor.inertia *= random.uniform(0.6, 1.4);
    rig.link.inertia *= random.uniform(0.6, 1.4);
    simulation::SimulationSettings run;
    run.excitation.type = "random";
    run.excitation.amplitude = random.uniform(150, 400);
    run.excitation.start_frequency = 0.3;
    run.excitation.end_frequency = random.uniform(2, 6);
    run.excitation.line_count = 40;
    run.excitation.seed = random.bits();
    run.sensors.seed = random.bits();
    run.sensors.of(record::Channel::motor_torque).noise = random.uniform(1, 3);
    run.sensors.of(record::Channel::motor_position).resolution = 8.7e-7;
    run.sensors.of(record::Channel::load_position).resolution = 7e-6;
    const diagnosis::Estimate e =
        diagnosis::estimate_position_difference(simulation::simulate_record(rig, run, 20), servo_settings());
    ASSERT_EQ(e.status, diagnosis::Status::ok) << e.message;
    EXPECT_NEAR(e.backlash_angle, rig.mesh.backlash, 2.5e-6);  // a third of the step of the load encoder
    right += e.angle_lower <= rig.mesh.backlash && rig.mesh.backlash <= e.angle_upper;
  }
  EXPECT_GE(right, cases - 2);  // 95 %: three misses of twelve have a probability of 2 %
}

// Records of a separate program: machines with an effect that the declared model lacks.
TEST(RigEstimators, PositionDifferenceOfServosWithUndeclaredEffects) {
  const struct {
    const char* name;
    double gap;             // rad, truth.json
    double least, largest;  // of the gap over the travel
  } machines[] = {{"dev1", 5.7420e-4, 1, 1}, {"dev2", 4.2104e-4, 0.75, 1.40}, {"dev3", 6.0202e-4, 1, 1},
                  {"dev4", 7.6486e-4, 1, 1}, {"dev5", 6.0759e-4, 1, 1},       {"dev6", 8.6334e-4, 1, 1}};
  int seen = 0;
  for (const auto& machine : machines)
    for (const char* part : {"train", "test"}) {
      const auto path = test::find_data(std::string("undeclared/") + machine.name + "/" + part + ".csv");
      if (!path) continue;
      ++seen;
      SCOPED_TRACE(*path);
      const diagnosis::Estimate e =
          diagnosis::estimate_position_difference(record::read_csv(*path), servo_settings());
      ASSERT_EQ(e.status, diagnosis::Status::ok) << e.message;
      const double width = e.angle_upper - e.angle_lower;
      EXPECT_GE(machine.gap, e.angle_lower - width);
      EXPECT_LE(machine.gap, e.angle_upper + width);
      if (machine.least == 1) {
        EXPECT_NEAR(e.backlash_angle, machine.gap, 2e-6) << e.message;  // 0.3 %
      } else {  // b (1 + 0.32 sin(3 q + 4.65) + 0.08 sin(5 q + 1.21)) over the travel
        EXPECT_NEAR(e.angle_lower, machine.least * machine.gap, 0.05 * machine.gap);
        EXPECT_NEAR(e.angle_upper, machine.largest * machine.gap, 0.05 * machine.gap);
      }
    }
  if (seen == 0) GTEST_SKIP() << "no undeclared/dev*/*.csv in $BACKLASH_DIAGNOSIS_DATA or ../shared/data";
}

/// Two runs of the demo's rig, one after the other.
record::Record of_two_plays(double first, double then, double rate) {
  rig_file::RigFile file = rig_file::default_rig_file();
  file.simulation.sensors.sampling_rate = rate;
  record::Record all;
  for (const double backlash : {first, then}) {
    file.rig.mesh.backlash = backlash;
    ++file.simulation.sensors.seed;
    const record::Record run = simulation::simulate_record(file.rig, file.simulation, 2);
    if (all.size() == 0) {
      all = run;
      continue;
    }
    for (const double t : run.time) all.time.push_back(2 + t);
    for (const record::Channel channel : record::kChannels)
      all.column(channel).insert(all.column(channel).end(), run.column(channel).begin(),
                                 run.column(channel).end());
  }
  return all;
}

// No interval may leave out what a part of the record has.
TEST(RigEstimators, APlayThatStepsWithinTheRecordIsNone) {
  for (const double then : {40e-6, 160e-6}) {
    const record::Record record = of_two_plays(80e-6, then, 5000);
    const diagnosis::Diagnosis d =
        diagnosis::diagnose(record, rig_file::default_rig_file().diagnosis, nullptr);
    int refused = 0;
    for (const diagnosis::Estimate& e : d.estimates) {
      refused += e.message.find("the play is not the same throughout the record") == 0;
      if (e.status != diagnosis::Status::ok) continue;
      EXPECT_LE(e.lower, std::min(80e-6, then)) << e.method << ": " << e.message;
      EXPECT_GE(e.upper, std::max(80e-6, then)) << e.method << ": " << e.message;
    }
    EXPECT_EQ(refused, 3) << then;  // lost_motion, position_difference, momentum_transfer
  }
}

// Teeth that yield linearly, several times as much as declared: no machine of the file's kind explains the
// torque, and the deflection that is taken off is as doubtful.
TEST(RigEstimators, DeclaredDeflectionOfAnotherMachineCountsTwice) {
  const rig_file::RigFile declared = rig_file::default_rig_file();
  rig_file::RigFile machine = declared;
  machine.rig.mesh.backlash = 60e-6;
  machine.rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", 2.2e5}, {"damping", 20}});
  simulation::SensorsSettings& sensors = machine.simulation.sensors;
  sensors.of(record::Channel::sensor_torque).noise = 2e-3;
  sensors.of(record::Channel::motor_position).resolution = 1e-6;
  const record::Record record = simulation::simulate_record(machine.rig, machine.simulation, 2);
  const diagnosis::Estimate alone = diagnosis::estimate_lost_motion(record, *declared.diagnosis.lost_motion);
  EXPECT_GT(alone.lower, 60e-6);
  for (const diagnosis::Estimate& e : diagnosis::diagnose(record, declared.diagnosis, nullptr).estimates) {
    if (e.method == "waveform" && e.status == diagnosis::Status::ok) {
      EXPECT_LT(e.lower, 60e-6) << e.message;
      EXPECT_GT(e.upper, 60e-6) << e.message;
    }
    if (e.method != "lost_motion") continue;
    EXPECT_EQ(e.backlash, alone.backlash);
    EXPECT_LT(e.lower, 60e-6) << e.message;
    EXPECT_NEAR(e.upper - e.backlash, 2 * (alone.upper - alone.backlash),
                0.1 * (alone.upper - alone.backlash));  // nearly all of it is declared
    EXPECT_NE(e.message.find("waveform finds in the record no machine"), std::string::npos) << e.message;
  }
}

/// What position_difference says of a machine that differs from the declared one as far as its file allows.
diagnosis::Estimate of_softer_servo(const rig_file::RigFile& declared, double gap, bool square_wave) {
  std::string softer = declared.text;
  softer.replace(softer.find("460e3"), 5, "400e3");
  rig_file::RigFile machine = rig_file::rig_file_from_text(softer, "softer");
  machine.rig.mesh.backlash = gap;
  machine.rig.link.inertia = 125;
  machine.rig.motor.coulomb_friction = 52;
  if (!square_wave) machine.simulation.excitation = test::shaking(11);
  const record::Record record = simulation::simulate_record(machine.rig, machine.simulation, 20);
  for (const diagnosis::Estimate& e : diagnosis::diagnose(record, declared.diagnosis, nullptr).estimates)
    if (e.method == "position_difference") return e;
  return {};
}

// The torque of a slow square wave has two values: play and compliance have nearly the same effect on the
// deflection, and only the ringing of the load distinguishes them. With a torque of many values all machines
// must be ok.
TEST(RigEstimators, ATorqueOfTwoValuesGivesNoWrongPlay) {
  const rig_file::RigFile declared = test::servo_file();
  for (const double gap : {3e-4, 7e-4, 1.1e-3}) {  // rad
    const diagnosis::Estimate square = of_softer_servo(declared, gap, true);
    if (square.status == diagnosis::Status::ok) {
      EXPECT_LE(square.angle_lower, gap) << square.message;
      EXPECT_GE(square.angle_upper, gap) << square.message;
    }
    const diagnosis::Estimate random = of_softer_servo(declared, gap, false);
    ASSERT_EQ(random.status, diagnosis::Status::ok) << gap << ": " << random.message;
    EXPECT_LE(random.angle_lower, gap);
    EXPECT_GE(random.angle_upper, gap);
    EXPECT_LT(random.angle_upper - random.angle_lower, 0.15 * gap) << "an interval that says something";
  }
}

}  // namespace
}  // namespace backlash::studies
