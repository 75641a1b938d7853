// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/lost_motion.h"
#include "locked_motor.h"

namespace backlash::diagnosis {
namespace {

using namespace locked_motor;

TEST(LostMotionRamp, PlayAtTheStatedTorqueIsTheClosedForm) {
  for (const double coulomb : {0.1, 0.5, 1.5}) {
    Machine machine;
    machine.coulomb = coulomb;
    const Estimate estimate = estimate_lost_motion(run(machine, {}), at(2.8));
    // The window holds 0.95 T to 1.05 T; its mean torque is within 2 % of T, so position within c * 0.05 N m
    // a side.
    EXPECT_NEAR(estimate.backlash_angle, machine.play(2.8, 4), 2 * 1e-3 * 0.05) << coulomb;
    EXPECT_EQ(estimate.method, "lost_motion");
  }
}

TEST(LostMotionRamp, GapComplianceAndFrictionAreSeparated) {
  const Machine machine;
  const Estimate estimate = estimate_lost_motion(run(machine, {}), at(3));
  ASSERT_TRUE(estimate.components) << estimate.message;
  // One sample is 0.01 N m of torque; averaging over a fiftieth of a passage rounds the branches by that
  // order.
  EXPECT_NEAR(estimate.components->coulomb, machine.coulomb, 0.05);
  EXPECT_NEAR(estimate.components->compliance, machine.compliance, 0.05 * machine.compliance);
  // Extrapolation over the flank (3.5 N m long) with the same relative error.
  EXPECT_NEAR(estimate.components->gap, machine.gap, 2 * 0.05 * machine.compliance * 3.5);
  EXPECT_EQ(estimate.components->at_torque, 3);
  EXPECT_TRUE(std::isnan(estimate.backlash));  // no base radius
}

TEST(LostMotionRamp, TorqueNoiseQuantisedPositionOffsetAndDriftDoNotMatter) {
  const Machine machine;
  Experiment experiment;
  experiment.torque_noise = 0.35;
  experiment.position_noise = 5e-5;
  experiment.offset = -0.2;
  experiment.drift = 2e-4;  // 4e-3 rad over the record, a sixth of the play
  record::Record record = run(machine, experiment);
  for (double& value : record.column(record::Channel::motor_position))
    value = std::round(value / 1e-4) * 1e-4;
  const Estimate estimate = estimate_lost_motion(record, at(3.5));
  expect_contains(estimate, machine.play(3.5, 4));
  // One step of the position.
  EXPECT_NEAR(estimate.backlash_angle, machine.play(3.5, 4), 1e-4);
  EXPECT_NEAR(estimate.components->coulomb, machine.coulomb, 0.1);
}

TEST(LostMotionRamp, OneSlippedRampIsCountedAndWidensTheInterval) {
  const Machine machine;
  Experiment experiment;
  experiment.position_noise = 5e-5;
  const Estimate clean = estimate_lost_motion(run(machine, experiment), at(3));
  experiment.slips = {{8.0, 0.0175}};  // a degree, through the third positive half period
  const Estimate slipped = estimate_lost_motion(run(machine, experiment), at(3));
  expect_contains(slipped, machine.play(3, 4));
  // The median moves within the scatter of the readings: position noise averaged over at least 10 samples,
  // three times.
  EXPECT_NEAR(slipped.backlash_angle, machine.play(3, 4), 2 * machine.compliance * 0.06 + 5e-5);
  EXPECT_GT(slipped.angle_upper - slipped.angle_lower, clean.angle_upper - clean.angle_lower);
  EXPECT_EQ(clean.message.find("far from"), std::string::npos) << clean.message;
  EXPECT_NE(slipped.message.find("2 of them far from"), std::string::npos)
      << slipped.message;  // into and out of it
}

TEST(LostMotionRamp, IntervalContainsTheTruthAsOftenAsItSays) {
  int inside = 0;
  const int records = 200;
  for (int k = 0; k < records; ++k) {
    const Machine machine;
    Experiment experiment;
    experiment.rate = 100;
    experiment.seed = static_cast<unsigned>(k);
    Random generator(1000 + experiment.seed);
    for (int half = 0; half < 10; ++half)
      experiment.slips.emplace_back(2.0 * half, 1e-3 * generator.normal());
    const Estimate estimate = estimate_lost_motion(run(machine, experiment), at(3.4));
    const double truth = machine.play(3.4, 4);
    inside += estimate.angle_lower <= truth && truth <= estimate.angle_upper;
  }
  // 95 % of 200 with a binomial standard deviation of 3.1: below 180 in one of a million runs.
  EXPECT_GE(inside, 180);
}

TEST(LostMotionRamp, TorqueFarBeyondTheStatedLevelIsNoSwitch) {
  const Machine machine;
  Experiment experiment;
  experiment.amplitude = 40;
  experiment.rate = 2000;
  const Estimate estimate = estimate_lost_motion(run(machine, experiment), at(3));
  // Mean torque in the window within 2 % of T.
  EXPECT_NEAR(estimate.angle_upper, machine.play(3, 40), 2 * machine.compliance * 0.06);
  EXPECT_GT(estimate.components->coulomb, 0.4);
}

// Dry friction hinders the way to the peak, where the flanks hold T - Fc at the stated torque, and holds what
// the peak has wound up on the way back, where they hold T + Fc. Half of both is gap + 2 c T.
TEST(LostMotionRamp, BothWaysToAndFromPeaksFarBeyondTheStatedTorqueAreInTheInterval) {
  Machine machine;
  Experiment experiment;
  experiment.duration = 40, experiment.frequency = 0.1;
  for (const double amplitude : {6.0, 12.0, 40.0}) {
    experiment.amplitude = amplitude;
    const Estimate estimate = estimate_lost_motion(run(machine, experiment), at(3));
    ASSERT_EQ(estimate.status, Status::ok) << estimate.message;
    const double middle = machine.gap + 2 * machine.compliance * 3,
                 apart = 2 * machine.compliance * machine.coulomb;
    // Torque changes by a tenth of 3 N m within each reading, of two walls.
    const double within = 2 * machine.compliance * 0.1 * 3;
    EXPECT_NEAR(estimate.backlash_angle, middle, within) << amplitude;
    EXPECT_NEAR(estimate.angle_lower, middle - apart, within) << amplitude;
    EXPECT_NEAR(estimate.angle_upper, middle + apart, within) << amplitude;
    EXPECT_NE(estimate.message.find("the interval holds both"), std::string::npos) << estimate.message;
  }
}

TEST(LostMotionFree, FreePlayComesOutForEveryShapeAmplitudeAndRate) {
  Machine machine;
  machine.coulomb = 0;
  machine.compliance = 0.04;
  machine.gap = 0.008;
  for (const Wave shape : {Wave::triangle, Wave::sine, Wave::square}) {
    for (const double amplitude : {0.05, 0.08}) {
      for (const double rate : {500.0, 1000.0, 10000.0}) {
        Experiment experiment;
        experiment.shape = shape;
        experiment.amplitude = amplitude;
        experiment.frequency = 10;
        experiment.duration = 0.3;  // three periods
        experiment.rate = rate;
        experiment.offset = 0.3;
        const Estimate estimate =
            estimate_lost_motion(run(machine, experiment), without_deflection(0.05, machine.compliance));
        expect_contains(estimate, machine.gap);
        // A window of 4 samples at 500 Hz lies off the torque's mean by at most a sample: 4 A f / rate of
        // torque.
        EXPECT_NEAR(estimate.backlash_angle, machine.gap,
                    2 * machine.compliance * 40 * amplitude / rate + 1e-9)
            << static_cast<int>(shape) << " " << amplitude << " " << rate;
      }
    }
  }
}

TEST(LostMotionFree, LevelMayBeTakenFromTheRecordAndBaseRadiusGivesLength) {
  Machine machine;
  machine.coulomb = 0;
  LostMotionSettings settings = without_deflection(kNaN, machine.compliance);
  settings.base_radius = 0.015;
  Experiment experiment;
  experiment.shape = Wave::square;
  const Estimate estimate = estimate_lost_motion(run(machine, experiment), settings);
  expect_contains(estimate, machine.gap);
  EXPECT_NEAR(estimate.backlash, 0.015 * machine.gap, 1e-9);  // exact but for rounding of sums
  EXPECT_DOUBLE_EQ(estimate.lower, 0.015 * estimate.angle_lower);
  EXPECT_DOUBLE_EQ(estimate.upper, 0.015 * estimate.angle_upper);
  EXPECT_NEAR(estimate.components->gap, machine.gap, 1e-9);
  EXPECT_TRUE(std::isnan(estimate.components->compliance));
  EXPECT_TRUE(std::isnan(estimate.components->coulomb));
  EXPECT_NE(estimate.message.find("neither compliance nor friction"), std::string::npos) << estimate.message;
}

TEST(LostMotionFree, UncertainDeflectionWidensTheInterval) {
  Machine machine;
  machine.coulomb = 0;
  Experiment experiment;
  experiment.shape = Wave::square;
  LostMotionSettings settings = without_deflection(3, machine.compliance);
  for (const double uncertainty : {0.0, 0.1}) {
    settings.elastic_uncertainty = uncertainty;
    const Estimate estimate = estimate_lost_motion(run(machine, experiment), settings);
    // Both sides deflect by c * 4 N m; nothing else is uncertain in this record but rounding and one position
    // step, which is the whole play here because the position takes two values only.
    const double step = machine.play(4, 4) - 0, half = (estimate.angle_upper - estimate.angle_lower) / 2;
    EXPECT_LE(half, std::hypot(step, uncertainty * 8e-3) * 1.01);
    EXPECT_GE(estimate.angle_upper - estimate.backlash_angle, uncertainty * 8e-3 * 0.99);
  }
}

// Square wave whose motion approaches the wall as W - B exp(-t/tau) + A exp(-t/tau) cos(omega t).
record::Record settling_record(double wall, double creep, double ring, double tau) {
  record::Record record;
  for (int i = 0; i < 2000; ++i) {
    const double time = i * 1e-3, since = (i % 50) * 1e-3, side = (i / 50) % 2 == 0 ? 1 : -1;
    const double decay = std::exp(-since / tau);
    record.time.push_back(time);
    record.column(record::Channel::motor_torque).push_back(side);
    record.column(record::Channel::motor_position)
        .push_back(side * (wall - creep * decay + ring * decay * std::cos(2 * M_PI * 150 * since)));
  }
  return record;
}

TEST(LostMotionFree, RingingIsAveragedAndInTheInterval) {
  const double wall = 5e-3;
  LostMotionSettings settings = without_deflection(1, 1e-3);
  settings.elastic_uncertainty = 0;
  const Estimate estimate = estimate_lost_motion(settling_record(wall, 0, 2e-3, 0.012), settings);
  expect_contains(estimate, 2 * wall - 2e-3);
  // At the window's begin (33 ms) the ring is 2e-3 exp(-33/12) = 1.3e-4; Hann over 2.4 of its periods leaves
  // a tenth.
  EXPECT_NEAR(estimate.backlash_angle, 2 * wall - 2e-3, 2 * 1.3e-5);
  // A quarter of the ring's rms over the window, 1.4e-3 exp(-33/12) sqrt(0.34) = 5.1e-5 rad, less a fifth for
  // whole samples.
  EXPECT_GT((estimate.angle_upper - estimate.angle_lower) / 2, 0.25 * 4e-5);
}

TEST(LostMotionRamp, RippleOfThePositionIsInTheInterval) {
  const double ripple = 2e-4;
  record::Record record = run({}, {});
  for (std::size_t i = 0; i < record.size(); ++i) {
    record.column(record::Channel::motor_position)[i] += ripple * std::sin(2 * M_PI * 30 * record.time[i]);
  }
  const Estimate estimate = estimate_lost_motion(record, at(3));
  expect_contains(estimate, Machine().play(3, 4));
  // Four times the rms of a sine, ripple / sqrt(2), less a tenth for a window of broken periods.
  EXPECT_GT((estimate.angle_upper - estimate.angle_lower) / 2, 0.9 * 4 * ripple / std::sqrt(2.0));
}

// Held for 20 ms mostly and for 60 ms at times, the motor rings at 45 Hz as it settles: windows at different
// stages of that have different means, and no end to which to extrapolate.
TEST(LostMotionFree, UnequalHoldsAreInTheInterval) {
  const double wall = 5e-3, ring = 4e-4, tau = 0.012;
  record::Record record;
  double side = 1, from = 0;
  int passage = 0;
  for (int i = 0; i < 3000; ++i) {
    const double time = i * 1e-3, length = passage % 3 == 2 ? 0.06 : 0.02;
    if (time - from > length - 1e-6) from = time, side = -side, ++passage;
    const double since = time - from;
    record.time.push_back(time);
    record.column(record::Channel::motor_torque).push_back(side);
    record.column(record::Channel::motor_position)
        .push_back(side * (wall - ring * std::exp(-since / tau) * std::cos(2 * M_PI * 45 * since)));
  }
  expect_contains(estimate_lost_motion(record, without_deflection(1, 1e-3)), 2 * wall - 2e-3);
}

TEST(LostMotionFree, CreepIsExtrapolated) {
  const double wall = 5e-3, creep = 1e-3, tau = 0.010;
  const Estimate estimate =
      estimate_lost_motion(settling_record(wall, creep, 0, tau), without_deflection(1, 1e-3));
  const double truth = 2 * wall - 2e-3;
  expect_contains(estimate, truth);
  // Geometric extrapolation is exact for one exponential; rounding of the window to samples remains.
  // Unextrapolated, 2 creep exp(-42/10) = 3e-5 rad would be missing.
  EXPECT_NEAR(estimate.backlash_angle, truth, 2e-7);
}

TEST(LostMotionFree, FrictionOnTheFlanksOfARampIsInTheInterval) {
  Machine machine;
  machine.coulomb = 0.3;
  const Estimate estimate = estimate_lost_motion(run(machine, {}), without_deflection(3, machine.compliance));
  expect_contains(estimate, machine.gap);
  // Friction holds the motor up to 2 c Fc farther on either side; the interval knows that order of size.
  EXPECT_GT(estimate.angle_upper - estimate.angle_lower, 2 * machine.compliance * machine.coulomb);
}

// A drive that gives 0.7 of what it says, or dry friction that takes 0.3: the flanks hold what the torque
// sensor says, whatever its offset.
TEST(LostMotionFree, TorqueThatTheSensorDoesNotConfirmIsInTheInterval) {
  Machine machine;
  machine.coulomb = 0;
  Experiment experiment;
  experiment.shape = Wave::square;
  experiment.position_noise = 1e-6;
  record::Record record = run(machine, experiment);
  std::vector<double>& torque = record.column(record::Channel::motor_torque);
  const std::vector<double> held = torque;
  for (double& t : torque) t /= 0.7;
  const LostMotionSettings settings = without_deflection(3, machine.compliance);
  EXPECT_LT(estimate_lost_motion(record, settings).angle_upper, machine.gap);  // 0.6 c 4 / 0.7 too small
  for (const double t : held) record.column(record::Channel::sensor_torque).push_back(0.97 * t + 0.5);
  const Estimate estimate = estimate_lost_motion(record, settings);
  expect_contains(estimate, machine.gap);
  EXPECT_NE(estimate.message.find("by sensor_torque it is 3.88 N m"), std::string::npos) << estimate.message;
  record.column(record::Channel::sensor_torque) = torque;  // and where it confirms it nothing changes
  EXPECT_LT(estimate_lost_motion(record, settings).angle_upper, machine.gap);
  record.column(record::Channel::sensor_torque).back() = kNaN;  // nor where it has gaps
  EXPECT_EQ(estimate_lost_motion(record, settings).status, Status::ok);
}

TEST(LostMotionStated, SwitchedTorqueBeyondTheLevelIsCorrectedWhereDeflectionIsKnown) {
  Machine machine;
  machine.coulomb = 0;
  Experiment experiment;
  experiment.shape = Wave::square;  // +-4 N m, stated 3 N m
  LostMotionSettings settings = at(3);
  expect_refusal(estimate_lost_motion(run(machine, experiment), settings), Status::out_of_domain,
                 "jumps past");
  settings.elastic_deflection = [&](double torque) { return machine.compliance * torque; };
  const Estimate estimate = estimate_lost_motion(run(machine, experiment), settings);
  EXPECT_NEAR(estimate.backlash_angle, machine.gap + 2 * machine.compliance * 3, 1e-9);  // rounding of sums
  EXPECT_NEAR(estimate.components->gap, machine.gap, 1e-9);
}

TEST(LostMotionStatus, NamesTheMissingChannel) {
  record::Record record = run({}, {});
  record.column(record::Channel::motor_position).clear();
  expect_refusal(estimate_lost_motion(record, at(3)), Status::insufficient_data, "motor_position");
  record = run({}, {});
  record.column(record::Channel::motor_torque).clear();
  expect_refusal(estimate_lost_motion(record, at(3)), Status::insufficient_data, "sensor_torque");
  expect_refusal(estimate_lost_motion(record::Record(), at(3)), Status::insufficient_data, "motor_position");
}

TEST(LostMotionStatus, SensorTorqueServesWhereMotorTorqueIsAbsent) {
  record::Record record = run({}, {});
  const double expected = estimate_lost_motion(record, at(3)).backlash_angle;
  record.column(record::Channel::motor_torque).swap(record.column(record::Channel::sensor_torque));
  EXPECT_DOUBLE_EQ(estimate_lost_motion(record, at(3)).backlash_angle, expected);
}

TEST(LostMotionStatus, TorqueBelowTheLevelIsOutOfDomainWithWhatWasReached) {
  Experiment experiment;
  experiment.amplitude = 2;
  expect_refusal(estimate_lost_motion(run({}, experiment), at(3)), Status::out_of_domain,
                 "needed are +-3 N m");
  expect_refusal(estimate_lost_motion(run({}, experiment), without_deflection(3, 1e-3)),
                 Status::out_of_domain, "1.9");
  record::Record one_sided = run({}, {});
  for (double& torque : one_sided.column(record::Channel::motor_torque)) torque = std::max(torque, -1.0);
  expect_refusal(estimate_lost_motion(one_sided, at(3)), Status::out_of_domain, "-1 N m");
}

TEST(LostMotionStatus, OneExcursionPerSideIsTooFewAndTwoGiveAWideInterval) {
  Experiment experiment;
  experiment.duration = 4;
  expect_refusal(estimate_lost_motion(run({}, experiment), at(3)), Status::insufficient_data,
                 "needed are 2 each");
  experiment.duration = 8.1;
  experiment.position_noise = 5e-5;
  const Estimate few = estimate_lost_motion(run({}, experiment), at(3));
  experiment.duration = 40.1;
  const Estimate many = estimate_lost_motion(run({}, experiment), at(3));
  ASSERT_EQ(few.status, Status::ok) << few.message;
  EXPECT_GT(few.angle_upper - few.angle_lower, many.angle_upper - many.angle_lower);
}

TEST(LostMotionStatus, MovingOutputIsOutOfDomain) {
  record::Record record = run({}, {});
  record.column(record::Channel::load_position).assign(record.size(), 0.7);
  EXPECT_EQ(estimate_lost_motion(record, at(3)).status, Status::ok);
  for (std::size_t i = 0; i < record.size(); ++i) {
    record.column(record::Channel::load_position)[i] =
        0.2 * record.column(record::Channel::motor_position)[i];
  }
  expect_refusal(estimate_lost_motion(record, at(3)), Status::out_of_domain, "not locked");
  LostMotionSettings settings = at(3);
  settings.locked_tolerance = 0.1;  // rad, more than it moves
  EXPECT_EQ(estimate_lost_motion(record, settings).status, Status::ok);
}

TEST(LostMotionStatus, MotionThatDoesNotSettleOrGoesTheWrongWayIsOutOfDomain) {
  expect_refusal(estimate_lost_motion(settling_record(5e-3, 0, 5e-3, 1.0), without_deflection(1, 1e-3)),
                 Status::out_of_domain, "come to rest");
  record::Record reversed = run({}, {});
  for (double& position : reversed.column(record::Channel::motor_position)) position = -position;
  expect_refusal(estimate_lost_motion(reversed, at(3)), Status::out_of_domain, "smaller positions");
  expect_refusal(estimate_lost_motion(run({}, {}), without_deflection(3, 1.0)), Status::out_of_domain,
                 "not this machine");
}

TEST(LostMotionStatus, SamplesThatAreNotFiniteAreSkipped) {
  record::Record record = run({}, {});
  const double expected = estimate_lost_motion(record, at(3)).backlash_angle;
  for (std::size_t i = 50; i < record.size(); i += 400)
    record.column(record::Channel::motor_position)[i] = kNaN;
  // A missing sample shifts a window by less than a sample, 0.01 N m of torque on each side.
  EXPECT_NEAR(estimate_lost_motion(record, at(3)).backlash_angle, expected, 2 * 1e-3 * 0.01);
}

TEST(LostMotionStatus, SettingsOutOfRangeThrow) {
  const record::Record record = run({}, {});
  for (const double torque : {0.0, -1.0, kNaN})
    EXPECT_THROW(estimate_lost_motion(record, at(torque)), InvalidParameter);
  LostMotionSettings settings = at(3);
  settings.subtract_elastic_deflection = true;
  EXPECT_THROW(estimate_lost_motion(record, settings), InvalidParameter);
  settings = at(3);
  settings.base_radius = 0;
  EXPECT_THROW(estimate_lost_motion(record, settings), InvalidParameter);
  settings = at(3);
  settings.elastic_uncertainty = -0.1;
  EXPECT_THROW(estimate_lost_motion(record, settings), InvalidParameter);
  settings = at(3);
  settings.locked_tolerance = 0;
  EXPECT_THROW(estimate_lost_motion(record, settings), InvalidParameter);
}

}  // namespace
}  // namespace backlash::diagnosis
