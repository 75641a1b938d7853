// SPDX-License-Identifier: BSD-3-Clause
// One file and one call make an effect known everywhere: to rig files and the simulation, to the searches for
// what a joint, a servo and an arm lack, to the search for changes, and to the errors of a fit that lacks it.
#include <gtest/gtest.h>

#include <cmath>

#include "arm/arm_machines.h"
#include "backlash_diagnosis/arm/trace.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/changes/changes.h"
#include "backlash_diagnosis/identification/effects/effect_search.h"
#include "backlash_diagnosis/identification/procedures/one_inertia.h"
#include "identification/fit/missing_effects.h"
#include "new_effect/eddy_current_brake.h"
#include "support/servo.h"

namespace backlash {
namespace {

const char* const kBrake = "eddy_current_brake";
const bool kRegistered = (model::register_term(test::eddy_current_brake()), true);

/// A joint by itself, its inverse dynamics along sums of sines.
struct Joint {
  double inertia = 0.45, viscous = 1.1, coulomb = 0.75;  // kg m^2, N m s/rad, N m
  double most = 0.6, critical = 0.4;                     // N m, rad/s, of the brake
  double since = 0;                                      // s, from when it has one
};

record::Record record_of(const Joint& joint, unsigned seed, double duration) {
  constexpr double kRate = 125, kNoise = 0.03;  // Hz, N m
  constexpr double kAmplitudes[] = {0.8, 0.6, 0.3}, kFrequencies[] = {0.11, 0.17, 0.29};
  Random random(seed);
  double phases[3];
  for (double& p : phases) p = random.uniform(0, 2 * M_PI);
  record::Record r;
  r.name = "made";
  for (int k = 0; k < int(duration * kRate); ++k) {
    const double t = k / kRate;
    double q = 0, v = 0, a = 0;
    for (int i = 0; i < 3; ++i) {
      const double w = 2 * M_PI * kFrequencies[i];
      q += kAmplitudes[i] * std::sin(w * t + phases[i]);
      v += kAmplitudes[i] * w * std::cos(w * t + phases[i]);
      a -= kAmplitudes[i] * w * w * std::sin(w * t + phases[i]);
    }
    double torque = joint.inertia * a + joint.viscous * v + joint.coulomb * (v < 0 ? -1 : 1);
    if (t >= joint.since) torque += test::eddy_current_torque(joint.most, joint.critical, v);
    r.time.push_back(t);
    r.column(record::Channel::motor_position).push_back(q);
    r.column(record::Channel::motor_torque).push_back(torque + kNoise * random.normal());
  }
  return r;
}

model::Rig one_inertia() {
  model::Rig rig = rig_file::load_rig_file(test::package_file("config/ur5_joint.yaml")).rig;
  rig.motor.inertia = 0.4, rig.motor.viscous_damping = 1, rig.motor.coulomb_friction = 1;
  return rig;
}

std::shared_ptr<const model::Term> brake(double most, double critical) {
  return model::make_term(kBrake, {{"torque", most}, {"speed", critical}});
}

TEST(NewEffect, IsRegisteredOnce) {
  EXPECT_TRUE(kRegistered);
  EXPECT_THROW(model::register_term(test::eddy_current_brake()), InvalidParameter);
}

TEST(NewEffect, IsReadFromARigFileAndSimulated) {
  rig_file::RigFile file = rig_file::load_rig_file(test::package_file("config/ur5_joint.yaml"));
  model::Rig rig = file.rig;
  rig.motor.inertia = 0.05, rig.motor.viscous_damping = 1, rig.motor.coulomb_friction = 1;
  rig.terms = {
      model::read_term(YamlReader::from_text("{id: eddy_current_brake, torque: 2, speed: 0.5}", "rig"))};
  simulation::SimulationSettings settings = file.simulation;
  settings.excitation.amplitude = 5, settings.excitation.frequency = 0.1;
  settings.sensors.channels = {};
  const record::Record r = simulation::simulate_record(rig, settings, 20);
  const std::vector<double>&q = r.column(record::Channel::motor_position),
        &torque = r.column(record::Channel::motor_torque);
  const double dt = r.time[1] - r.time[0];
  int looked_at = 0;
  for (std::size_t k = 1; k + 1 < q.size(); ++k) {
    const double v = (q[k + 1] - q[k - 1]) / (2 * dt), a = (q[k + 1] - 2 * q[k] + q[k - 1]) / (dt * dt);
    if (std::fabs(v) < 0.2) continue;
    const double balance = 0.05 * a + v + (v < 0 ? -1 : 1) + test::eddy_current_torque(2, 0.5, v);
    EXPECT_NEAR(torque[k], balance, 0.01);  // differences over 20 ms of a motion of some rad/s^3
    ++looked_at;
  }
  EXPECT_GT(looked_at, 500);
}

TEST(NewEffect, IsNamedOfAJoint) {
  const Joint joint;
  const identification::Trace trace =
      identification::trace_residual(one_inertia(), {record_of(joint, 1, 60)}, record_of(joint, 2, 40));
  ASSERT_EQ(trace.steps.size(), 1u);
  EXPECT_EQ(trace.steps[0].id, kBrake);
  for (const identification::EffectParameter& p : trace.steps[0].parameters)
    EXPECT_NEAR(p.measured.value, p.name == "torque" ? joint.most : joint.critical,
                4 * p.measured.standard_error)
        << p.name;
}

TEST(NewEffect, IsNamedOfAServo) {
  model::Rig machine = test::other_servo();
  machine.terms = {brake(40, 0.5)};
  const record::Record train = simulation::simulate_record(machine, test::servo_run(11), 6),
                       unseen = simulation::simulate_record(machine, test::servo_run(12), 6);
  const identification::Trace trace = identification::trace_residual(test::servo_file().rig, {train}, unseen);
  ASSERT_EQ(trace.steps.size(), 1u);
  EXPECT_EQ(trace.steps[0].id, kBrake);
}

TEST(NewEffect, IsReportedAsAChange) {
  Joint healthy, braked;
  healthy.since = INFINITY, braked.since = 90;
  const changes::Changes found = changes::detect_changes(
      one_inertia(), {record_of(healthy, 1, 200), record_of(healthy, 2, 200)}, record_of(braked, 3, 200), {});
  ASSERT_EQ(found.changes.size(), 1u);
  EXPECT_EQ(found.changes[0].effect, kBrake);
  EXPECT_NEAR(found.changes[0].since, 90, 4);
}

TEST(NewEffect, IsNamedOfAnArm) {
  const test::Machine healthy(32);
  test::Machine machine(32);
  machine.effect = {kBrake, 0.3, "", {6, 0}};
  machine.affected = 0;
  const arm::ArmTrace trace =
      arm::trace_arm(machine.declared, {healthy.record(1), healthy.record(2)}, machine.record(3), false);
  for (const arm::ArmTrace::Rejected& r : trace.rejected)
    if (r.effect == kBrake) std::cout << r.joint << ": " << r.reason << '\n';
  ASSERT_EQ(trace.steps.size(), 1u);
  EXPECT_EQ(trace.steps[0].effect, kBrake);
  EXPECT_EQ(trace.steps[0].joint, trace.joints[0]);
}

TEST(NewEffect, WidensTheErrorsOfAFitThatLacksIt) {
  const std::vector<model::JointMoment> moments = {
      {0, 0.1, 0.2, 1, 3}, {1, 0.2, -1, -1, 2}, {2, 0.3, 1.5, 1, 1}};
  bool listed = false;
  for (const identification::EffectShapes& effect : identification::likely_effects(moments))
    for (const double share : {0.1, 0.3, 1.0}) {  // of the rms speed, as the term says
      const double critical = share * std::sqrt((0.2 * 0.2 + 1 + 1.5 * 1.5) / 3);
      bool same = true;
      for (std::size_t k = 0; k < moments.size(); ++k)
        same &=
            std::fabs(effect.shapes[0][k] - test::eddy_current_torque(1, critical, moments[k].speed)) < 1e-12;
      listed |= same;
    }
  EXPECT_TRUE(listed);
  const Joint joint;
  const identification::OneInertia m = identification::identify_one_inertia(record_of(joint, 1, 60));
  EXPECT_LT(std::fabs(m.coulomb.value - joint.coulomb), 3 * m.coulomb.standard_error);
  EXPECT_LT(std::fabs(m.viscous.value - joint.viscous), 3 * m.viscous.standard_error);
  EXPECT_LT(std::fabs(m.inertia.value - joint.inertia), 3 * m.inertia.standard_error);
}

}  // namespace
}  // namespace backlash
