// SPDX-License-Identifier: BSD-3-Clause
// Oracle: machines whose torques KDL computes.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "arm_machines.h"
#include "backlash_diagnosis/arm/fit_records.h"
#include "backlash_diagnosis/arm/trace.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/signal/order_statistics.h"

namespace backlash::arm {
namespace {

std::vector<ArmMotion> motions(const test::Machine& machine, const std::vector<ArmRecord>& records) {
  std::vector<ArmMotion> all;
  std::vector<std::string> warnings;
  for (const ArmRecord& record : records)
    for (ArmMotion& m : motions_of(record, machine.declared, warnings)) all.push_back(std::move(m));
  return all;
}

std::vector<FittedMotion> fitted(const std::vector<ArmMotion>& motions) {
  std::vector<FittedMotion> all;
  for (const ArmMotion& m : motions) all.push_back({&m, false});
  return all;
}

TEST(Fit, FindsDrivesAndPredictsAnotherMotion) {
  int far = 0, values = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const test::Machine machine(seed);
    const auto train = motions(machine, {machine.record(10 * seed), machine.record(10 * seed + 1)});
    const auto test = motions(machine, {machine.record(10 * seed + 2)});
    const ArmFit fit = fit_arm(machine.declared, fitted(train));
    const std::vector<double> errors = relative_errors(fit, {}, fitted(test), 5);
    for (std::size_t j = 0; j < 6; ++j) {
      // What noise leaves, and one percent for turning points within the low-pass, where friction jumps.
      EXPECT_LT(errors[j], 2 * fit.floor[j] + 0.01) << seed << " " << j;
      EXPECT_TRUE(is_consistent(fit.rig.chain.links[j]));
      const auto check = [&](const signal::Measured& m, double truth) {
        ++values;
        const double z = std::fabs(m.value - truth) / m.standard_error;
        far += z > 3;
        EXPECT_LT(z, 6) << seed << " " << j << ": " << m.value << " +- " << m.standard_error << ", true "
                        << truth;
      };
      check(fit.drives[j][kDriveTerms], machine.drives[j].constant);
      check(fit.drives[j][std::size_t(DriveTerm::coulomb)], machine.drives[j].terms[1]);
      check(fit.drives[j][std::size_t(DriveTerm::offset)], machine.drives[j].terms[5]);
    }
  }
  EXPECT_LE(far, 4) << "of " << values;  // by chance of a normal distribution: one in 370
}

TEST(Fit, SaysWhyItCannot) {
  test::Machine machine(1);
  ArmRecord still = machine.record(1, 20);
  for (record::Record& joint : still.joints) {
    for (double& q : joint.column(record::Channel::motor_position)) q = 0.5;
    for (double& v : joint.column(record::Channel::motor_velocity)) v = 0;
  }
  const auto resting = motions(machine, {still});
  EXPECT_THROW(fit_arm(machine.declared, fitted(resting)), CannotIdentify);
  const ArmTrace trace = trace_arm(machine.declared, {still}, machine.record(2, 20), false);
  EXPECT_TRUE(trace.cannot_tell);
  EXPECT_TRUE(trace.steps.empty());
  EXPECT_NE(trace.judged.find("cannot be fitted to the training records"), std::string::npos) << trace.judged;
  std::vector<std::string> warnings;
  EXPECT_THROW(motions_of(machine.record(1, 2), machine.declared, warnings), BadData);
  const std::vector<record::JointRecord> one = {{"elbow_joint", still.joints[2]}};
  EXPECT_THROW(arm_record(one, machine.declared, "x.csv"), BadData);
}

TEST(Trace, FindsAPayloadWithItsLinkAndMass) {
  const test::Machine machine(5);
  test::Machine loaded = machine;
  Body body;
  body.mass = 2.5;
  body.centre = {0.03, -0.08, 0.15};
  body.inertia = 0.005 * Eigen::Matrix3d::Identity();
  loaded.chain.links[5] += parameters_of(body);
  const ArmTrace trace =
      trace_arm(machine.declared, {machine.record(1), machine.record(2)}, loaded.record(3), false);
  ASSERT_EQ(trace.steps.size(), 1u);
  const ArmStep& step = trace.steps[0];
  EXPECT_EQ(step.effect, "payload");
  EXPECT_EQ(step.link, "wrist_3_link");
  const double truth[] = {2.5, 0.03, -0.08, 0.15};
  for (std::size_t i = 0; i < 4; ++i) {
    const signal::Measured& m = step.parameters[i].measured;
    EXPECT_LT(std::fabs(m.value - truth[i]), 4 * m.standard_error)
        << step.parameters[i].name << " " << m.value;
    // Blocks of time leave 0.02 m; friction that lags by a tenth of Coulomb's makes it 0.033 m.
    EXPECT_LT(m.standard_error, i == 0 ? 0.3 : 0.04);
  }
  EXPECT_FALSE(trace.unexplained);
  for (std::size_t j = 0; j < 6; ++j) EXPECT_LT(trace.after[j], 0.05);
  // And the other way round: a body is no longer there.
  const ArmTrace back =
      trace_arm(machine.declared, {loaded.record(4), loaded.record(5)}, machine.record(6), false);
  ASSERT_EQ(back.steps.size(), 1u);
  EXPECT_EQ(back.steps[0].effect, "payload");
  const signal::Measured gone = back.steps[0].parameters[0].measured;
  EXPECT_LT(std::fabs(gone.value + 2.5), 4 * gone.standard_error)
      << gone.value << " +- " << gone.standard_error;
}

TEST(Trace, NamesNothingWhereNothingHasChanged) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const test::Machine machine(seed);
    const ArmTrace trace =
        trace_arm(machine.declared, {machine.record(100 + seed)}, machine.record(200 + seed), false);
    EXPECT_TRUE(trace.steps.empty()) << seed << " " << (trace.steps.empty() ? "" : trace.steps[0].effect);
    EXPECT_FALSE(trace.unexplained) << seed << " " << trace.unexplained->channel
                                    << trace.unexplained->signature;
    EXPECT_EQ(trace.before, trace.after);
  }
}

// The same body, mounted in another place: the fitted machine finds that of the test record, and the same
// mass.
TEST(Trace, OfAFittedMachineThePayloadOfTheTestRecordCounts) {
  const test::Machine machine(9);
  const auto base = motions(machine, {machine.record(1), machine.record(2)});
  ArmRig rig = fit_arm(machine.declared, fitted(base)).rig;
  double masses[2];
  const Eigen::Vector3d centres[] = {{0.03, -0.12, 0.15}, {-0.08, 0.05, 0.2}};
  const auto loaded = [&](int i) {
    test::Machine m = machine;
    Body body;
    body.mass = 3;
    body.centre = centres[i];
    body.inertia = 0.01 * Eigen::Matrix3d::Identity();
    m.chain.links[5] += parameters_of(body);
    return m.record(i == 0 ? 20 : 21);
  };
  for (int i = 0; i < 2; ++i) {
    const ArmTrace trace = trace_arm(rig, {loaded(1 - i)}, loaded(i), false);
    ASSERT_EQ(trace.steps.size(), 1u);
    EXPECT_EQ(trace.steps[0].effect, "payload");
    const auto& p = trace.steps[0].parameters;
    masses[i] = p[0].measured.value;
    EXPECT_LT(std::fabs(masses[i] - 3), 3 * p[0].measured.standard_error);
    for (int k = 0; k < 3; ++k)
      EXPECT_LT(std::fabs(p[std::size_t(1 + k)].measured.value - centres[i][k]),
                4 * p[std::size_t(1 + k)].measured.standard_error + 0.002)
          << k;
    EXPECT_FALSE(trace.unexplained);
    EXPECT_FALSE(trace.notes.empty());  // what the training record carries
  }
  EXPECT_NEAR(masses[0] / masses[1], 1, 0.03);
}

// Friction and offsets that differ by some percent are a robot that warms up, and no payload.
TEST(Trace, WarmingUpIsNoEffect) {
  const test::Machine machine(21);
  test::Machine warm = machine;
  const double factors[] = {0.9, 1.08, 0.92, 1.1, 0.88, 1.05};
  for (std::size_t j = 0; j < 6; ++j) {
    for (const int t : {1, 2, 3, 4, 6}) warm.drives[j].terms[std::size_t(t)] *= factors[j];
    warm.drives[j].terms[5] += 0.02 * (j % 2 == 0 ? 1 : -1) * machine.drives[j].terms[1];
  }
  const ArmTrace trace = trace_arm(machine.declared, {machine.record(1)}, warm.record(2), false);
  EXPECT_TRUE(trace.steps.empty());
  EXPECT_FALSE(trace.unexplained) << trace.unexplained->channel << trace.unexplained->signature;
  EXPECT_EQ(trace.notes.size(), 6u);  // reported, joint by joint
}

// A cable that pulls as a spring: no effect of the dictionary, and the joint is not as it was trained.
TEST(Trace, WhatItDoesNotKnowIsUnexplained) {
  const test::Machine healthy(33);
  test::Machine machine = healthy;
  machine.effect.id = "cable", machine.effect.values[0] = 25;  // N m/rad
  machine.affected = 1;
  const ArmTrace trace =
      trace_arm(healthy.declared, {healthy.record(1), healthy.record(2)}, machine.record(3), false);
  for (const ArmStep& step : trace.steps) EXPECT_NE(step.joint, trace.joints[1]) << step.effect;
  ASSERT_TRUE(trace.unexplained);
  EXPECT_EQ(trace.unexplained->channel, trace.joints[1] + "/torque") << trace.unexplained->signature;
}

// All records have it, so that none lets expect anything else.
TEST(Trace, ATorqueFromOutsideInAllRecordsIsUnexplained) {
  const test::Machine machine(2);
  const auto pushed = [&](std::uint64_t seed) {
    ArmRecord record = machine.record(seed);
    std::vector<double>& current = record.joints[2].column(machine.declared.channel);
    const double size = 0.2 * signal::quantile_range(current, 0.25);  // of half of what it spans
    for (std::size_t k = 0; k < current.size(); ++k)
      current[k] += size * std::sin(3.1 * record.joints[2].time[k] + double(seed));
    return record;
  };
  const ArmTrace trace = trace_arm(machine.declared, {pushed(102), pushed(103)}, pushed(202), false);
  EXPECT_TRUE(trace.steps.empty());
  ASSERT_TRUE(trace.unexplained);
  EXPECT_EQ(trace.unexplained->channel, "elbow_joint/torque");
  EXPECT_NE(trace.unexplained->signature.find("a torque from outside"), std::string::npos)
      << trace.unexplained->signature;
}

TEST(Trace, FindsGravityFromAnotherDirection) {
  const test::Machine machine(7);
  test::Machine tilted = machine;
  tilted.chain.gravity = Eigen::AngleAxisd(0.06, Eigen::Vector3d::UnitX()) * machine.chain.gravity;
  const ArmTrace trace =
      trace_arm(machine.declared, {machine.record(1), machine.record(2)}, tilted.record(3), false);
  ASSERT_EQ(trace.steps.size(), 1u);
  EXPECT_EQ(trace.steps[0].effect, "gravity_direction");
  const auto& p = trace.steps[0].parameters;
  EXPECT_LT(std::fabs(p[0].measured.value - 0.06),
            4 * p[0].measured.standard_error + 0.002);  // linear in the angle
  EXPECT_LT(std::fabs(p[1].measured.value), 4 * p[1].measured.standard_error + 0.002);
}

TEST(Trace, FindsFrictionOfOneJoint) {
  const test::Machine machine(8);
  test::Machine rubbing = machine;
  for (const int t : {1, 2, 3, 4, 6}) rubbing.drives[3].terms[std::size_t(t)] *= 1.6;
  const ArmTrace trace =
      trace_arm(machine.declared, {machine.record(1), machine.record(2)}, rubbing.record(3), false);
  ASSERT_EQ(trace.steps.size(), 1u);  // the factor is that of all its friction
  EXPECT_EQ(trace.steps[0].effect, "friction_drift");
  EXPECT_EQ(trace.steps[0].joint, "wrist_1_joint");
  EXPECT_NEAR(trace.steps[0].parameters[0].measured.value, 1.6, 0.1);
}

// A factor of all friction explains part of it, and so does a wave of the position.
TEST(Trace, ViscousFrictionAloneIsNoFactorOfAllFriction) {
  const test::Machine machine(8);
  test::Machine thick = machine;
  thick.drives[1].terms[2] *= 6;
  const ArmTrace trace =
      trace_arm(machine.declared, {machine.record(1), machine.record(2)}, thick.record(3), false);
  ASSERT_EQ(trace.steps.size(), 1u);
  EXPECT_EQ(trace.steps[0].effect, "motor_viscous");
  EXPECT_EQ(trace.steps[0].joint, "shoulder_lift_joint");
  const signal::Measured& more = trace.steps[0].parameters[0].measured;
  EXPECT_NEAR(more.value, 5 * machine.drives[1].terms[2], 4 * more.standard_error);
  EXPECT_LT(more.standard_error, 0.1 * more.value);
}

/// An effect of one joint that the rig file does not know.
JointEffect unknown_effect(const std::string& id, double size, double shape = 0) {
  return {id, shape, id == "transmission_coupling" ? "elbow_joint" : "", Eigen::Vector2d(size, 0)};
}

enum class When { always, since_training, fitted_before };

struct EffectCase {
  When when;
  JointEffect effect;
  std::size_t joint;
};

std::ostream& operator<<(std::ostream& out, const EffectCase& c) {
  return out << c.effect.id << " of joint " << c.joint;
}

class JointEffects : public testing::TestWithParam<EffectCase> {
 protected:
  static test::Machine machine_with(const EffectCase& c) {
    test::Machine out(c.when == When::always ? 31 : 32);
    out.effect = c.effect;
    out.affected = c.joint;
    out.coupled = c.effect.other.empty() ? c.joint : 2;  // elbow_joint
    return out;
  }

  static void expect_named(const ArmTrace& trace, const EffectCase& c) {
    for (const ArmTrace::Rejected& r : trace.rejected)
      std::cout << r.effect << " of " << r.joint << ": " << r.reason << '\n';
    ASSERT_EQ(trace.steps.size(), 1u);
    const ArmStep& step = trace.steps[0];
    EXPECT_EQ(step.effect, c.effect.id);
    EXPECT_EQ(step.joint, trace.joints[c.joint]);
    EXPECT_EQ(step.other_joint, c.effect.other);
    // Four standard errors, and 2 % for what low-passes leave of shapes.
    const auto near = [](const signal::Measured& m, double truth) {
      EXPECT_LT(std::fabs(m.value - truth), 4 * m.standard_error + 0.02 * truth)
          << m.value << " +- " << m.standard_error;
    };
    near(step.parameters[0].measured, c.effect.values[0]);
    if (c.effect.shape > 0) near(step.parameters.back().measured, c.effect.shape);
    EXPECT_LT(trace.after[c.joint], 0.7 * trace.before[c.joint]);
    EXPECT_FALSE(trace.unexplained) << trace.unexplained->signature;
  }
};

TEST_P(JointEffects, AreNamed) {
  const EffectCase& c = GetParam();
  const test::Machine machine = machine_with(c), healthy(c.when == When::always ? 31 : 32);
  const test::Machine& trained = c.when == When::always ? machine : healthy;
  const std::vector<ArmRecord> train = {trained.record(1), trained.record(2)};
  if (c.when == When::fitted_before) {
    const auto base = motions(healthy, train);
    const ArmRig rig = fit_arm(healthy.declared, fitted(base)).rig;
    return expect_named(trace_arm(rig, {machine.record(3)}, machine.record(4), false), c);
  }
  const ArmTrace trace = trace_arm(healthy.declared, train, machine.record(3), false);
  expect_named(trace, c);
  EXPECT_EQ(trace.notes.size(), c.when == When::always ? 0u : 1u);  // the training does not have it
}

TEST(FitRecords, ABodyInOneOfThemContradictsTheOthers) {
  const test::Machine machine(7);
  test::Machine loaded(7);
  Body body;
  body.mass = 3;
  body.centre = {0, 0, 0.1};
  loaded.chain.links.back() += parameters_of(body);
  std::vector<std::string> warnings;
  const auto records = [&](const test::Machine& second) {
    return std::vector<RecordMotions>{motions_of(machine.record(1), machine.declared, warnings),
                                      motions_of(second.record(2), machine.declared, warnings)};
  };
  const ArmFit same = fit_records(machine.declared, records(machine));
  EXPECT_TRUE(same.contradictions.empty()) << description(same.contradictions);
  const ArmFit fit = fit_records(machine.declared, records(loaded));
  std::vector<std::string> joints;
  for (const Contradiction& c : fit.contradictions) joints.push_back(c.joint);
  for (const std::size_t j : {1, 2})  // which lift it
    EXPECT_NE(std::find(joints.begin(), joints.end(), machine.declared.joints[j].name), joints.end());
  EXPECT_NE(fit.warnings.back().find("The records contradict each other"), std::string::npos);
  for (std::size_t j = 0; j < 6; ++j)
    for (const DriveTerm term : {DriveTerm::coulomb, DriveTerm::offset}) {
      const signal::Measured &wide = fit.drives[j][std::size_t(term)],
                             &own = same.drives[j][std::size_t(term)];
      EXPECT_NEAR(wide.value, own.value, 2 * wide.standard_error + 4 * own.standard_error) << j;
    }
  const ArmTrace trace =
      trace_arm(machine.declared, {machine.record(1), loaded.record(2)}, machine.record(3), false);
  EXPECT_TRUE(trace.cannot_tell);
  EXPECT_TRUE(trace.steps.empty());
  EXPECT_NE(trace.judged.find("records contradict each other"), std::string::npos) << trace.judged;
}

// With the effect in the rig file nothing is missing any more, on records that nobody has seen.
// A joint whose torque, or whose position and speed, count the other way than the URDF says.
TEST(FitRecords, AJointWithAnotherSignIsNamed) {
  const test::Machine machine(1);
  std::vector<std::string> warnings;
  const auto refusal = [&](std::size_t joint, const std::vector<record::Channel>& channels) -> std::string {
    ArmRecord record = machine.record(10);
    for (const record::Channel channel : channels)
      for (double& x : record.joints[joint].column(channel)) x = -x;
    try {
      fit_records(machine.declared, {motions_of(record, machine.declared, warnings)});
      return "";
    } catch (const CannotIdentify& error) {
      return error.what();
    }
  };
  EXPECT_EQ(refusal(0, {}), "");
  for (const std::size_t joint : {0u, 2u, 4u}) {
    const std::string name = machine.declared.joints[joint].name;
    EXPECT_EQ(refusal(joint, {machine.declared.channel}).find(name), 0u)
        << refusal(joint, {machine.declared.channel});
    const std::string moved =
        refusal(joint, {record::Channel::motor_position, record::Channel::motor_velocity});
    EXPECT_EQ(moved.find(name), 0u) << moved;
    EXPECT_NE(moved.find("the sign of its torque or of its position"), std::string::npos) << moved;
  }
}

TEST(Trace, TheRigThatIsWrittenClosesTheLoop) {
  const EffectCase c = {When::always, unknown_effect("cogging", 1.5, 7.3), 1};
  test::Machine machine(31);
  machine.effect = c.effect, machine.affected = c.joint;
  const std::vector<ArmRecord> train = {machine.record(1), machine.record(2)};
  const ArmTrace trace = trace_arm(machine.declared, train, machine.record(3), false);
  const ArmRig known = arm_rig_from_text(arm_rig_text(trace.augmented, {}), "known.yaml", "");
  ArmRig without = known;
  without.joints[c.joint].effects.clear();
  const ArmTrace again = trace_arm(known, {machine.record(4)}, machine.record(5), false),
                 before = trace_arm(without, {machine.record(4)}, machine.record(5), false);
  EXPECT_TRUE(again.steps.empty()) << again.steps[0].effect;
  EXPECT_FALSE(again.unexplained) << again.unexplained->signature;
  EXPECT_LT(again.after[c.joint], 0.3 * before.before[c.joint]);
  ASSERT_EQ(before.steps.size(), 1u);
  EXPECT_EQ(before.steps[0].effect, c.effect.id);
}

INSTANTIATE_TEST_SUITE_P(
    Arm, JointEffects,
    testing::Values(EffectCase{When::always, unknown_effect("stribeck", 6, 0.15), 0},
                    EffectCase{When::always, unknown_effect("transmission_coupling", 0.12), 4},
                    EffectCase{When::since_training, unknown_effect("position_dependent_friction", 1.2, 3),
                               2},
                    EffectCase{When::since_training, unknown_effect("presliding", 4, 0.06), 1},
                    EffectCase{When::since_training, unknown_effect("motor_torque_gain", 0.12), 2},
                    EffectCase{When::since_training, unknown_effect("stribeck", 3, 0.5), 3},
                    EffectCase{When::fitted_before, unknown_effect("motor_torque_gain", -0.1), 1},
                    EffectCase{When::fitted_before, unknown_effect("asymmetric_viscous", 4), 0},
                    EffectCase{When::fitted_before, unknown_effect("cogging", 1.5, 7.3), 1}),
    [](const auto& info) { return info.param.effect.id + std::to_string(info.param.joint); });

}  // namespace
}  // namespace backlash::arm
