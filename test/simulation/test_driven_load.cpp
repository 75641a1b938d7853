// SPDX-License-Identifier: BSD-3-Clause
// The load that follows a recorded motor, against the other integrator: the whole train simulated with
// SUNDIALS.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <set>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/rig_file/rig_parameters.h"
#include "backlash_diagnosis/simulation/driven_load.h"
#include "support/rig_changes.h"
#include "support/rigs.h"
#include "support/servo.h"

namespace backlash::simulation {
namespace {

using test::other_servo;

RecordedMotion motion_of(const record::Record& record) {
  RecordedMotion motion;
  motion.interval = record.sampling_interval();
  motion.motor = &record.column(record::Channel::motor_position);
  motion.motor_rate = &record.column(record::Channel::motor_velocity);
  motion.first_load = record.column(record::Channel::load_position).front();
  motion.first_load_rate = record.column(record::Channel::load_velocity).front();
  return motion;
}

double worst(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::fabs(a[k] - b[k]));
  return largest;
}

TEST(DrivenLoad, RepeatsTheWholeTrain) {
  const model::Rig rig = other_servo();
  const record::Record record = simulate_record(rig, test::servo_run(3, false), 5);
  const DrivenLoad driven = simulate_driven_load(rig, motion_of(record));
  // No feedback here. A sample's step of the fixed integrator is exact to 1e-9 rad in contact; an impact
  // within it is placed to a fraction of a sample: at 0.1 rad/s between the flanks some 1e-5 rad for a
  // moment, and friction wears that off. The deflection is 1e-3 rad.
  EXPECT_LT(worst(driven.load, record.column(record::Channel::load_position)), 2e-5);
  EXPECT_LT(worst(driven.load_rate, record.column(record::Channel::load_velocity)), 5e-3);
}

// As RepeatsTheWholeTrain; without friction nothing wears an impact's error off, and the load drifts.
TEST(DrivenLoad, WithoutDryFrictionItRepeatsTheWholeTrain) {
  model::Rig rig = other_servo();
  rig.motor.coulomb_friction = rig.link.coulomb_friction = 0;
  const record::Record record = simulate_record(rig, test::servo_run(3, false), 5);
  const DrivenLoad driven = simulate_driven_load(rig, motion_of(record));
  EXPECT_LT(worst(driven.load, record.column(record::Channel::load_position)), 2e-4);
  EXPECT_LT(worst(driven.load_rate, record.column(record::Channel::load_velocity)), 5e-3);
}

/// rad, root mean square, by which a load with this output coupling is off that of the servo behind a shaft
/// with this share of the inertia on its gear.
double off_the_train(double share, const model::Coupling& output) {
  model::Rig rig = test::servo_behind_shaft(share);
  const record::Record record = simulate_record(rig, test::servo_run(3, false), 5);
  RecordedMotion motion = motion_of(record);
  rig.output_coupling = output;
  const DrivenLoad driven = simulate_driven_load(rig, motion);
  double square = 0;
  for (std::size_t k = 0; k < record.size(); ++k)
    square += std::pow(driven.load[k] - record.column(record::Channel::load_position)[k], 2);
  return std::sqrt(square / double(record.size()));
}

// The whole train has a gear with mass, which rings for a moment between teeth and shaft after each impact:
// the less of it, the nearer. A load without a shaft is ten times as far off.
TEST(DrivenLoad, BehindAShaftMovesAsTheTrainWithALightGear) {
  const model::Coupling shaft = test::servo_behind_shaft(0.01).output_coupling;
  const double light = off_the_train(0.002, shaft);
  EXPECT_LT(light, off_the_train(0.05, shaft));
  EXPECT_LT(light, 0.1 * off_the_train(0.002, {}));
}

TEST(DrivenLoad, FeedbackHoldsALoadThatStartsWrong) {
  const model::Rig rig = other_servo();
  const record::Record record = simulate_record(rig, test::servo_run(4, false), 3);
  RecordedMotion motion = motion_of(record);
  motion.load_rate = &record.column(record::Channel::load_velocity);
  motion.first_load_rate = 0.5;
  const DrivenLoad driven = simulate_driven_load(rig, motion);
  double late = 0;
  for (std::size_t k = 1000; k < record.size(); ++k)
    late = std::max(late, std::fabs(driven.load[k] - record.column(record::Channel::load_position)[k]));
  EXPECT_LT(late, 2e-5);
}

TEST(DrivenLoad, FreeLoadInTheGapStopsAsCoulombSays) {
  model::Rig rig = other_servo();
  rig.mesh.backlash = 1;  // rad: never touched
  rig.link.viscous_damping = 0;
  const std::vector<double> still(1000, 0.0);
  RecordedMotion motion{1e-3, &still, &still, nullptr, 0, 0.05};
  const DrivenLoad driven = simulate_driven_load(rig, motion);
  // It slides w^2 / (2 a) with a = F / J = 18/84 rad/s^2 and stands after w / a = 0.2333 s, for good.
  const double a = 18.0 / 84;
  EXPECT_NEAR(driven.load.back(), 0.05 * 0.05 / (2 * a), 1e-9);
  EXPECT_EQ(driven.load_rate[234], 0);
  EXPECT_EQ(driven.load[400], driven.load.back());
  EXPECT_NEAR(driven.load_rate[100], 0.05 - a * 0.1, 1e-12);
}

TEST(DrivenLoad, HeldMotorUnderContactBalances) {
  model::Rig rig = other_servo();
  rig.link.coulomb_friction = 0;
  const std::vector<double> still(20000, 0.0);
  RecordedMotion motion{1e-3,    &still, &still,
                        nullptr, -6e-4,  0};  // pressed into the flank by 2.85e-4 rad, let go
  const DrivenLoad driven = simulate_driven_load(rig, motion);
  EXPECT_NEAR(driven.mesh_torque.front(), 400e3 * (6e-4 - 3.15e-4),
              1e-6);  // spring, motor ahead: drives forward
  EXPECT_NEAR(driven.mesh_on_motor.front(), -driven.mesh_torque.front(), 20);  // falls within the sample
  EXPECT_LT(std::fabs(driven.load.back()), 3.15e-4 + 1e-9);                    // ends in the gap
}

TEST(DrivenLoad, LockedLoadStands) {
  model::Rig rig = other_servo();
  rig.link_locked = true;
  const std::vector<double> pressed(5, 6e-4), still(5, 0.0);
  const RecordedMotion motion{1e-3, &pressed, &still, nullptr, 0, 0};
  const DrivenLoad driven = simulate_driven_load(rig, motion);
  const MotorTorques motor = motor_torques(rig, motion, driven);
  EXPECT_EQ(driven.load.back(), 0);
  EXPECT_NEAR(motor.mean[2], -400e3 * (6e-4 - 3.15e-4), 1e-9);
  EXPECT_EQ(motor.friction[2].forward, 47);
}

TEST(DrivenLoad, RigidMeshTakesTheLoadAlong) {
  model::Rig rig = other_servo();
  rig.mesh.rigid = true;
  const std::vector<double> position = {0, 2e-3, 4e-3, 6e-3, 8e-3}, rate(5, 2.0);
  const RecordedMotion motion{1e-3, &position, &rate, nullptr, 0, 0};
  const DrivenLoad driven = simulate_driven_load(rig, motion);
  const MotorTorques motor = motor_torques(rig, motion, driven);
  EXPECT_EQ(driven.load, position);
  EXPECT_NEAR(motor.mean[2], -(10 + 7) * 2.0, 1e-9);  // both bodies' viscous friction
  EXPECT_EQ(motor.friction[2].forward, 47 + 18);
}

// T = J a less the torques on the load: 0.1 of it more friction, with J = 6.1 + 108 kg m^2 less the motor's
// own.
TEST(DrivenLoad, FrictionOfOneInertiaFollowsWhatItsLoadTakes) {
  model::Rig rig = other_servo();
  rig.mesh.rigid = true;
  ParameterValues values = {{"coefficient", 0.1}};
  values.set_choice("body", "motor");
  rig.terms.push_back(model::make_term("load_dependent_friction", values));
  rig.terms.push_back(model::make_term("gravity", {{"amplitude", 40}, {"phase", M_PI / 2}}));
  const std::vector<double> still(4, 0.0), acceleration = {0, 2, -3, 0};
  const RecordedMotion motion{1e-3, &still, &still, nullptr, 0, 0, &acceleration};
  const MotorTorques motor = motor_torques(rig, motion, simulate_driven_load(rig, motion));
  for (std::size_t k = 0; k < still.size(); ++k)
    EXPECT_NEAR(motor.friction[k].forward, 47 + 18 + 0.1 * std::fabs(rig.link.inertia * acceleration[k] + 40),
                1e-9);
}

// Flanks are looked up less often than forces.
// Friction that drifts is as far in the second part of a record as it was in the whole.
TEST(DrivenLoad, APartOfARecordRunsOn) {
  model::Rig rig;
  rig.mesh.rigid = true;
  rig.motor.inertia = 1;
  ParameterValues values = {{"change", 3}, {"span", 2}, {"rate", 1}};
  values.set_choice("body", "motor");
  rig.terms.push_back(model::make_term("friction_drift", values));
  std::vector<double> position, rate(2000, 0.5);
  for (std::size_t k = 0; k < rate.size(); ++k) position.push_back(5e-4 * double(k));
  const std::vector<double> later(position.begin() + 1200, position.end()), later_rate(later.size(), 0.5);
  RecordedMotion whole{1e-3, &position, &rate}, part{1e-3, &later, &later_rate};
  part.start = 1.2;
  const auto friction = [&](const RecordedMotion& motion, std::size_t k) {
    return motor_torques(rig, motion, simulate_driven_load(rig, motion)).friction[k].forward;
  };
  for (const std::size_t k : {0, 700}) EXPECT_NEAR(friction(part, k), friction(whole, 1200 + k), 1e-9);
  EXPECT_NEAR(friction(part, 0), 3 * std::expm1(-1.2) / std::expm1(-2), 1e-9);
}

TEST(DrivenLoad, RepeatsATrainWithShapedFlanks) {
  model::Rig rig = other_servo();
  const auto error =
      model::make_term("transmission_error", {{"amplitude", 1e-4}, {"order", 60}, {"phase", 0.3}});
  rig.terms = {error};
  const record::Record record = simulate_record(rig, test::servo_run(3, false), 5);
  const DrivenLoad driven = simulate_driven_load(rig, motion_of(record));
  EXPECT_LT(worst(driven.load, record.column(record::Channel::load_position)), 2e-5);  // as without
  struct Always
      : model::Term {  // says that it follows the torque: then flanks are looked up with every force
    std::shared_ptr<const model::Term> error;
    bool shapes_flanks() const override { return true; }
    bool shape_follows_torque() const override { return true; }
    void shape(const model::FlankPoint& at, model::FlankShift& shift) const override {
      error->shape(at, shift);
    }
  };
  const auto always = std::make_shared<Always>();
  always->error = error;
  rig.terms = {always};
  // Where the flanks are looked up is wrong by h^3 / 12 times the rate of acceleration, 1e4 rad/s^3 after a
  // touch: 1e-6 rad, of which they move A n = 6e-3, for some samples.
  EXPECT_LT(worst(driven.load, simulate_driven_load(rig, motion_of(record)).load), 2e-8);
  rig.terms.clear();
  const DrivenLoad without = simulate_driven_load(rig, motion_of(record));
  EXPECT_GT(worst(without.load, record.column(record::Channel::load_position)), 8e-5);
}

// With a load that is simulated by one rig and a motor that another one says: as if both were one.
TEST(DrivenLoad, WhatMovesNoLoadNeedsNoSimulation) {
  const model::Rig rig = other_servo();
  model::Rig motor = rig, load = rig;
  motor.motor.viscous_damping += 3;
  motor.terms.push_back(model::make_term("cogging", {{"amplitude", 5}, {"order", 40}, {"phase", 0}}));
  motor.mesh.contact = model::make_contact_law(rig.mesh.contact_spec().law, rig.mesh.contact_spec().values);
  load.link.viscous_damping += 1;
  EXPECT_TRUE(acting_on_load(rig) == acting_on_load(motor));
  EXPECT_FALSE(acting_on_load(rig) == acting_on_load(load));
  load = rig;
  load.mesh.backlash *= 1.001;
  EXPECT_FALSE(acting_on_load(rig) == acting_on_load(load));
  load = rig;
  load.terms.push_back(model::make_term("gravity", {{"amplitude", 5}, {"phase", 0}}));
  EXPECT_FALSE(acting_on_load(rig) == acting_on_load(load));
  const record::Record record = simulate_record(rig, test::servo_run(3, false), 2);
  const RecordedMotion motion = motion_of(record);
  const DrivenLoad followed = simulate_driven_load(rig, motion), same = simulate_driven_load(motor, motion);
  EXPECT_EQ(followed.load, same.load);
  const MotorTorques torques = motor_torques(motor, motion, followed);
  // About a sample, of sin(n q) with q = w t: the mean over triangular weights is sinc^2 of half the phase.
  const std::size_t k = 700;
  const double w = record.column(record::Channel::motor_velocity)[k], half = 0.5 * 40 * w * motion.interval;
  const double cogging = 5 * std::sin(40 * record.column(record::Channel::motor_position)[k]) *
                         std::pow(std::sin(half) / half, 2);
  const double viscous = (rig.motor.viscous_damping + 3) * w;
  // acceleration of some 10 rad/s^2 changes the speed within a sample by 0.01 rad/s, its mean by 1/12 of the
  // change of that
  EXPECT_NEAR(torques.mean[k], followed.mesh_on_motor[k] - viscous - cogging, 0.02);
}

/// Acts on the load by nothing.
struct Nothing : model::Term {};

bool same_motion(const DrivenLoad& a, const DrivenLoad& b) {
  return a.load == b.load && a.load_rate == b.load_rate && a.mesh_torque == b.mesh_torque &&
         a.mesh_on_motor == b.mesh_on_motor;
}

/// On the gear and behind a shaft, each with linear teeth and with others.
std::vector<model::Rig> plain_rigs() {
  std::vector<model::Rig> all = {other_servo(), test::servo_behind_shaft(0.01)};
  for (int i : {0, 1}) {
    all.push_back(all[i]);
    all.back().mesh.contact =
        model::make_contact_law("hunt_crossley", {{"stiffness", 4e6}, {"exponent", 1.5}, {"alpha", 0.4}});
  }
  for (std::size_t i = 0; i < all.size(); ++i) all[i].name = std::to_string(i);
  return all;
}

// A load of numbers alone is followed by other code than one with terms, which does the same.
TEST(DrivenLoad, APlainLoadMovesAsTheTrainDoes) {
  for (model::Rig rig : plain_rigs()) {
    rig.link.viscous_asymmetry = 0.5;
    const record::Record record = simulate_record(rig, test::servo_run(3, false), 2);
    model::Rig with_term = rig;
    with_term.terms.push_back(std::make_shared<Nothing>());
    EXPECT_TRUE(model::GearTrain(rig).plain_load());
    EXPECT_FALSE(model::GearTrain(with_term).plain_load());
    EXPECT_TRUE(same_motion(simulate_driven_load(rig, motion_of(record)),
                            simulate_driven_load(with_term, motion_of(record))))
        << rig.name;
  }
}

// Number by number, whatever happens to each: other gaps and frictions touch and stick at other samples.
TEST(DrivenLoad, SeveralAtOnceMoveAsEachAlone) {
  for (const model::Rig& rig : plain_rigs()) {
    const record::Record record = simulate_record(rig, test::servo_run(3, false), 2);
    RecordedMotion motion = motion_of(record);
    motion.load_rate = &record.column(record::Channel::load_velocity);
    std::vector<model::Rig> rigs;
    std::vector<double> first_loads;
    for (std::size_t count = 1; count <= loads_at_once(); ++count) {
      rigs.push_back(rig);
      rigs.back().mesh.backlash *= 0.5 * double(count);
      rigs.back().link.inertia *= 1 + 0.1 * double(count);
      rigs.back().link.coulomb_friction *= double(count - 1);
      rigs.back().output_coupling.stiffness *= double(count);
      first_loads.push_back(motion.first_load + 1e-4 * double(count));
      const std::vector<DrivenLoad> all = simulate_driven_loads(rigs, first_loads, motion, 50);
      ASSERT_EQ(all.size(), count > 1 ? count : 0);
      for (std::size_t i = 0; i < all.size(); ++i) {
        RecordedMotion own = motion;
        own.first_load = first_loads[i];
        EXPECT_TRUE(same_motion(all[i], simulate_driven_load(rigs[i], own, 50))) << rig.name << " " << i;
      }
    }
  }
}

TEST(DrivenLoad, OthersDoNotMoveAtOnce) {
  const model::Rig rig = other_servo();
  const record::Record record = simulate_record(rig, test::servo_run(3, false), 0.1);
  model::Rig with_term = rig, other_law = rig, behind_shaft = rig;
  behind_shaft.output_coupling = test::servo_behind_shaft(0.01).output_coupling;
  behind_shaft.bearing_at_gear = true;
  with_term.terms.push_back(std::make_shared<Nothing>());
  other_law.mesh.contact =
      model::make_contact_law("hunt_crossley", {{"stiffness", 4e6}, {"exponent", 1.5}, {"alpha", 0.4}});
  for (const model::Rig& other : {with_term, other_law, behind_shaft})
    EXPECT_TRUE(simulate_driven_loads({rig, other}, {0, 0}, motion_of(record), 50).empty());
}

// Whoever keeps a simulated load must not take it for that of another machine.
TEST(DrivenLoad, AnyChangeOfTheRigThatMovesTheLoadIsSeen) {
  const model::Rig rig = other_servo();
  const record::Record record = simulate_record(rig, test::servo_run(3, false), 1);
  const RecordedMotion motion = motion_of(record);
  const DrivenLoad before = simulate_driven_load(rig, motion);
  std::set<std::string> idle;  // changes that leave the load as it is
  const auto expect_seen = [&](const std::string& name, const model::Rig& changed) {
    if (acting_on_load(rig) == acting_on_load(changed)) {
      EXPECT_TRUE(same_motion(before, simulate_driven_load(changed, motion))) << name;
      idle.insert(name);
    }
  };
  for (const test::RigChange& change : test::rig_changes()) {
    model::Rig changed = rig;
    change.apply(changed);
    expect_seen(change.member, changed);
  }
  for (const rig_file::RigParameter& parameter : rig_file::servo_parameters()) {
    if (!parameter.known_to(rig)) continue;  // of another contact law
    model::Rig changed = rig;
    parameter.set(changed, 1.1 * parameter.get(rig) + (parameter.positive() ? 0 : 0.3));
    expect_seen(parameter.name, changed);
  }
  // These are worth a simulation less.
  const std::set<std::string> expected = {"name",
                                          "coupled",
                                          "encoder_skew",
                                          "joint",
                                          "reduction_ratio",
                                          "motor_side",
                                          "linear",
                                          "torque_constant",
                                          "sensor_with_damper",
                                          "terms of the motor",
                                          "motor.inertia",
                                          "motor.viscous_damping",
                                          "motor.viscous_asymmetry",
                                          "motor.coulomb_friction",
                                          "motor.coulomb_asymmetry",
                                          "pinion.inertia",
                                          "pinion.viscous_damping",
                                          "pinion.viscous_asymmetry",
                                          "pinion.coulomb_friction",
                                          "pinion.coulomb_asymmetry",
                                          "input_coupling.stiffness",
                                          "input_coupling.damping",
                                          "input_coupling.inertia",
                                          "motor_inertia",
                                          "motor_coulomb",
                                          "motor_viscous",
                                          "motor_coulomb_asymmetry",
                                          "motor_viscous_asymmetry"};
  EXPECT_EQ(idle, expected);
}

TEST(DrivenLoad, RefusesOtherTrains) {
  const std::vector<double> still(10, 0.0);
  const RecordedMotion motion{1e-3, &still, &still, nullptr, 0, 0};
  EXPECT_THROW(simulate_driven_load(test::sarkar_rig(1e-5), motion), InvalidParameter);
}

}  // namespace
}  // namespace backlash::simulation
