// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "identification/fit/calibration.h"
#include "identification/fit/multi_start.h"
#include "support/one_inertia_bench.h"

namespace backlash::identification {
namespace {

Machine declared_machine() {
  Machine machine;
  machine.rig = test::one_inertia_rig();
  machine.calibrations.resize(1);
  for (const char* name : {"motor_inertia", "motor_coulomb", "motor_viscous"})
    machine.parameters.push_back(machine_parameter(name, machine.rig));
  return machine;
}

TEST(MultiStart, OtherStartsAreWithinTheSpreadAndTheSameForASeed) {
  const Machine machine = declared_machine();
  std::set<double> inertias;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const Machine other = other_start(machine, 0.4, seed);
    EXPECT_EQ(other.rig.motor.inertia, other_start(machine, 0.4, seed).rig.motor.inertia);
    EXPECT_LE(std::fabs(std::log(other.rig.motor.inertia / machine.rig.motor.inertia)), 0.4);
    inertias.insert(other.rig.motor.inertia);
  }
  EXPECT_EQ(inertias.size(), 50u);
  EXPECT_LT(*inertias.begin(), 0.75 * machine.rig.motor.inertia);
  EXPECT_GT(*inertias.rbegin(), 1.3 * machine.rig.motor.inertia);
}

TEST(MultiStart, FindsTheMachineAndWhatItsTorqueIs) {
  const test::SearchBench bench{test::OneInertiaMachine()};
  int fits = 0;
  const BandFit fit =
      fit_to_records(bench.data, declared_machine(), bench.context.settings.fit, [&] { ++fits; });
  EXPECT_NEAR(fit.fit.machine.rig.motor.inertia, 2, 0.02);
  EXPECT_NEAR(fit.fit.machine.rig.motor.coulomb_friction, 3, 0.03);
  EXPECT_NEAR(fit.fit.machine.rig.motor.viscous_damping, 1.5, 0.03);
  EXPECT_LT(fit.misfit.torque, 1.3);
  EXPECT_EQ(fits, 4);  // one start, which leaves noise, and three in the whole band
}

TEST(MultiStart, TriesOtherStartsWhereMoreThanNoiseIsLeft) {
  test::OneInertiaMachine machine;
  machine.extra = test::cogging_torque(3, 4, 0.3);
  const test::SearchBench bench{machine};
  int fits = 0;
  const BandFit fit =
      fit_from_starts(bench.data, declared_machine(), bench.context.settings.fit, [&] { ++fits; });
  EXPECT_GT(fit.misfit.torque, 2);
  EXPECT_EQ(fits, 2);  // the residual is linear in all parameters: a second start ends in the same minimum
}

TEST(MultiStart, MoreIsKnownOfAMachineBesideTheRecords) {
  const test::SearchBench bench{test::OneInertiaMachine()};
  Machine machine = declared_machine();
  machine.priors.emplace_back([](const model::Rig& rig) { return (rig.motor.inertia - 2.1) / 1e-6; });
  const BandFit fit = fit_to_records(bench.data, machine, bench.context.settings.fit);
  EXPECT_NEAR(fit.fit.machine.rig.motor.inertia, 2.1, 1e-5);
}

Machine with_delay(double samples, bool held) {
  Machine machine = declared_machine();
  machine.calibrations[0].torque_delay = samples;
  machine.calibrations[0].held = held;
  return machine;
}

// A held torque acts half a sample later than its stamp, in the mean.
TEST(Calibration, HeldOrOfTheMomentIsWhatIsNearer) {
  for (const auto& [delay, held] : {std::pair{-0.2, true}, {-0.3, false}, {0.4, true}}) {
    Machine machine = with_delay(delay, true);
    release_hold(machine);
    EXPECT_EQ(machine.calibrations[0].held, held) << delay;
    EXPECT_NEAR(machine.calibrations[0].torque_delay + (held ? 0.5 : 0), delay + 0.5, 1e-12);
  }
  for (const auto& [delay, held] : {std::pair{0.2, false}, {0.3, true}, {-0.4, false}}) {
    Machine machine = with_delay(delay, false);
    restore_hold(machine);
    EXPECT_EQ(machine.calibrations[0].held, held) << delay;
    EXPECT_NEAR(machine.calibrations[0].torque_delay + (held ? 0.5 : 0), delay, 1e-12);
  }
}

TEST(Calibration, ALongDelayIsNoCalibration) {
  Machine machine = with_delay(-0.8, true);
  limit_delay(machine, 0.5);
  EXPECT_EQ(machine.calibrations[0].torque_delay, -0.5);
  EXPECT_EQ(machine.largest_delay, 0);  // fitted no more
  machine = with_delay(0.4, true);
  limit_delay(machine, 0.5);
  EXPECT_EQ(machine.calibrations[0].torque_delay, 0.4);
  EXPECT_EQ(machine.largest_delay, 0.5);
}

TEST(Calibration, BecomesPartOfADelayThatIsATerm) {
  Machine machine = with_delay(2, true);
  machine.rig.terms.push_back(model::make_term("delay", {{"delay", 0.001}}));
  move_delay_to_term(machine, 0.01);
  EXPECT_NEAR(machine.rig.terms.back()->values.at("delay"), 0.021, 1e-12);
  EXPECT_EQ(machine.calibrations[0].torque_delay, 0);
  EXPECT_EQ(machine.largest_delay, 0);
}

}  // namespace
}  // namespace backlash::identification
