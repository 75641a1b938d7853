// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "backlash_diagnosis/identification/fit/fit_settings.h"
#include "backlash_diagnosis/model/mesh_resonance.h"
#include "support/one_inertia_bench.h"
#include "support/servo.h"

namespace backlash::identification {
namespace {

// sqrt(k (1 / J_M + 1 / J_L)) / 2 pi of config/two_inertia_servo.yaml, by hand.
constexpr double kServoResonance = 44.24;  // Hz

TEST(MeshResonance, IsThatOfTwoInertiasAndASpring) {
  const model::Rig servo = test::servo_file().rig;
  EXPECT_NEAR(mesh_resonance(servo, 100), kServoResonance, 0.01);
  model::Rig locked = servo;
  locked.link_locked = true;
  EXPECT_NEAR(mesh_resonance(locked, 100), std::sqrt(460e3 / 6.3) / (2 * M_PI), 0.01);
  EXPECT_EQ(mesh_resonance(test::one_inertia_rig(), 100), 0);
}

// F = K d^1.5: dF/dd = 1.5 K^(2/3) F^(1/3), so eight times the torque is sqrt(2) times the frequency.
TEST(MeshResonance, OfHertzianTeethRisesWithTheTorque) {
  model::Rig rig = test::servo_file().rig;
  rig.mesh.contact =
      model::make_contact_law("hunt_crossley", {{"stiffness", 1.5e7}, {"exponent", 1.5}, {"alpha", 0.0}});
  const double stiffness = 1.5 * std::pow(1.5e7, 2.0 / 3) * std::cbrt(100.0);
  EXPECT_NEAR(mesh_resonance(rig, 100), std::sqrt(stiffness * (1 / 6.3 + 1 / 108.0)) / (2 * M_PI), 0.1);
  EXPECT_NEAR(mesh_resonance(rig, 800) / mesh_resonance(rig, 100), std::sqrt(2.0), 1e-3);
}

ServoData shaken() {
  ServoData data;
  data.interval = 1e-3;
  for (int k = 0; k < 2000; ++k) {
    data.torque.push_back(100 * std::sin(0.01 * k));
    data.motor.push_back(0.1 * std::sin(0.01 * k));
  }
  return data;
}

TEST(FitSettings, BandsFollowTheMeshResonance) {
  model::Rig rig = test::servo_file().rig;
  const FitSettings s = with_bands({}, rig, {shaken()});
  // The bands that were found for this machine.
  EXPECT_NEAR(s.cutoff, 60, 0.01);
  EXPECT_NEAR(s.rough_cutoff, 15, 0.01);
  EXPECT_NEAR(s.feedback, 50, 0.01);
  // Four times lighter and shorter in time: a machine twice as fast has bands twice as wide.
  rig.motor.inertia /= 4;
  rig.link.inertia /= 4;
  const FitSettings fast = with_bands({}, rig, {shaken()});
  EXPECT_NEAR(fast.cutoff / s.cutoff, 2, 1e-6);
  EXPECT_NEAR(fast.rough_cutoff / s.rough_cutoff, 2, 1e-6);
  EXPECT_NEAR(fast.feedback / s.feedback, 2, 1e-6);
}

TEST(FitSettings, AskedBandsStayAndSamplingLimitsTheOthers) {
  FitSettings asked;
  asked.cutoff = 10;
  asked.feedback = 7;
  const FitSettings s = with_bands(asked, test::servo_file().rig, {shaken()});
  EXPECT_EQ(s.cutoff, 10);
  EXPECT_EQ(s.rough_cutoff, 10);  // never above the cutoff
  EXPECT_EQ(s.feedback, 7);
  ServoData slow = shaken();
  slow.interval = 0.01;
  EXPECT_EQ(with_bands({}, test::servo_file().rig, {slow}).cutoff, 0.2 / 0.01);
}

TEST(FitSettings, OfOneInertiaTheMotionSetsTheBand) {
  const test::SearchBench bench{test::OneInertiaMachine()};
  // A motion below 0.5 Hz: 100 periods in 20 s.
  EXPECT_NEAR(bench.context.settings.fit.cutoff, 5, 1e-9);
  EXPECT_EQ(bench.context.settings.fit.rough_cutoff, bench.context.settings.fit.cutoff);
}

TEST(ServoData, TimeBetweenReversals) {
  ServoData data;
  data.interval = 0.01;
  for (int k = 0; k < 1000; ++k) data.motor_rate.push_back(std::cos(M_PI * 0.01 * k + 0.1));  // 0.5 Hz
  data.motor.assign(data.motor_rate.size(), 0.0);
  EXPECT_NEAR(time_between_reversals(data), 10.0 / 11, 1e-9);
  data.rate_noise = 0.3;  // five deviations are above every speed
  EXPECT_NEAR(time_between_reversals(data), 10, 1e-9);
}

}  // namespace
}  // namespace backlash::identification
