// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/diagnosis/gap_traverse.h"

namespace backlash::diagnosis {
namespace {

/// Two inertias and a gap in steps of 5 us (Euler, positions from new speeds), driven to and fro by a torque
/// that jumps: a simulator of the test's own.
struct Servo {
  double gap = 5e-4, stiffness = 4e5, damping = 450;  // rad, N m/rad, N m s/rad
  double motor_inertia = 7, load_inertia = 90;        // kg m^2
  double motor_viscous = 12, motor_coulomb = 50, load_coulomb = 15;
  double hertz = 0;                 // N m; > 0: K in^p (1 + chi in'), as stiff and damped at this torque
  double exponent = 1.5;            // p
  double gravity = 0, cogging = 0;  // N m: on the load, constant; on the motor, order 36
  double amplitude = 500;           // N m
  double noise = 2, step = 8.7e-7;  // N m, rad
  double duration = 20;
  double later = 0;                   // rad; > 0: the gap from the middle of the record on
  double load_step = 0;               // rad; > 0: the load has an encoder
  double eccentricity = 0, skew = 0;  // rad, s, of it
  bool smooth = false;                // a stiff speed loop makes the motor follow two sines instead

  double pressed(double in, double rate) const {
    if (hertz == 0) return stiffness * in + damping * rate;
    const double there = exponent * hertz / stiffness;  // slope p T / in
    return hertz * std::pow(in / there, exponent) * (1 + damping / hertz * rate);
  }

  record::Record record(int rate = 1000) const {
    constexpr double kStep = 5e-6;
    const int per_sample = int(std::lround(1 / (rate * kStep)));
    record::Record r;
    Random random(5);
    double qm = 0.5 * gap, wm = 0, ql = 0, wl = 0, torque = 0;
    for (long i = 0; i * kStep < duration; ++i) {
      const double t = double(i) * kStep;
      if (i % per_sample == 0) {
        const double wave = std::sin(2 * M_PI * 0.9 * t) + 0.6 * std::sin(2 * M_PI * 2.3 * t + 1);
        torque = amplitude * (0.4 * wave + 0.6 * std::copysign(1.0, std::sin(2 * M_PI * 1.7 * t)));
        const double wanted = 0.3 * std::sin(2 * M_PI * 0.23 * t) + 0.125 * std::sin(2 * M_PI * 1.9 * t);
        if (smooth) torque = 4800 * (wanted - wm) + 22 * std::sin(2 * M_PI * 7 * t);
        r.time.push_back(t);
        r.column(record::Channel::motor_torque).push_back(torque + noise * random.normal());
        r.column(record::Channel::motor_position).push_back(step * std::round(qm / step));
        if (load_step > 0) {
          const double shown = ql + 0.3 + eccentricity * std::sin(ql + 1) - skew * wl;
          r.column(record::Channel::load_position).push_back(load_step * std::round(shown / load_step));
        }
      }
      const double now = later > 0 && t > 0.5 * duration ? later : gap;
      const double x = qm - ql, in = std::fabs(x) - 0.5 * now, side = x > 0 ? 1 : -1;
      const double teeth = in > 0 ? side * std::fmax(0.0, pressed(in, side * (wm - wl))) : 0.0;
      wm += kStep / motor_inertia *
            (torque - teeth - motor_viscous * wm - motor_coulomb * std::tanh(wm / 1e-4) -
             cogging * std::sin(36 * qm));
      wl += kStep / load_inertia * (teeth - load_coulomb * std::tanh(wl / 1e-4) - gravity);
      qm += kStep * wm, ql += kStep * wl;
    }
    return r;
  }
};

/// Declared within 30 %, the gap within a factor of two.
GapTraverseSettings declared() {
  GapTraverseSettings s;
  s.motor_inertia = 6, s.load_inertia = 110;
  s.motor_damping = 13, s.motor_friction = 60, s.load_friction = 15;
  s.flank.stiffness = 4.6e5, s.flank.damping = 480, s.gap = 2.5e-4;
  return s;
}

void expect_gap(const Servo& servo, const Estimate& e, double within = 0.1) {
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_LT(e.angle_lower, servo.gap) << e.message;
  EXPECT_GT(e.angle_upper, servo.gap) << e.message;
  // By default: the estimator's interval (kModel) is for every machine of the header within 10 %.
  EXPECT_NEAR(e.backlash_angle, servo.gap, within * servo.gap) << e.message;
}

TEST(GapTraverse, EstimatesThePlayOfOrdinaryMotionFromTheMotorsSide) {
  for (const double gap : {1.5e-4, 5e-4, 1.5e-3}) {
    Servo servo;
    servo.gap = gap;
    expect_gap(servo, estimate_gap_traverse(servo.record(), declared()),
               0.05);  // of a machine as it is declared
  }
}

// One in 200, and a gap of 20: the rows are missing from the fit, and no crossing is refused for them.
TEST(GapTraverse, LostSamplesAreMissingRows) {
  const Servo servo;
  const record::Record whole = servo.record();
  std::vector<double> kept;
  Random random(4);
  for (std::size_t i = 0; i < whole.size(); ++i)
    if (random.uniform(0, 1) > 0.005 && (i < 5000 || i >= 5020)) kept.push_back(whole.time[i]);
  expect_gap(servo, estimate_gap_traverse(record::samples_at(whole, kept), declared()), 0.05);
  // A recorder that was held for half a second.
  kept.erase(std::remove_if(kept.begin(), kept.end(), [](double t) { return t > 7 && t < 7.5; }), kept.end());
  expect_gap(servo, estimate_gap_traverse(record::samples_at(whole, kept), declared()), 0.05);
}

// The load's encoder is set at any angle, eccentric and late; the torque is not asked for.
class GapTraverseOfBothEncoders : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(GapTraverseOfBothEncoders, EstimatesThePlay) {
  const auto [gap, eccentricity] = GetParam();
  Servo servo;
  servo.gap = gap, servo.load_step = 7e-6, servo.eccentricity = eccentricity, servo.skew = eccentricity;
  record::Record record = servo.record();
  record.column(record::Channel::motor_torque).clear();
  // Tolerance: the law of the teeth is free between lines and points, a fifth of the deflection of 0.7 mrad
  // at most.
  const Estimate e = estimate_gap_traverse(record, declared());
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_LE(e.angle_lower, gap) << e.message;
  EXPECT_GE(e.angle_upper, gap) << e.message;
  EXPECT_NEAR(e.backlash_angle, gap, 1.4e-4) << e.message;
}

INSTANTIATE_TEST_SUITE_P(Servos, GapTraverseOfBothEncoders,
                         testing::Combine(testing::Values(3e-4, 5e-4, 1.5e-3), testing::Values(0.0, 2e-4)));

TEST(GapTraverse, HoldsForTeethAfterHertzWithBothEncoders) {
  Servo servo;
  servo.hertz = 300, servo.load_step = 7e-6, servo.gravity = 40, servo.cogging = 15;
  const Estimate e = estimate_gap_traverse(servo.record(), declared());
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_LE(e.angle_lower, servo.gap) << e.message;
  EXPECT_GE(e.angle_upper, servo.gap) << e.message;
  EXPECT_LT(e.angle_upper, 3 * e.angle_lower) << e.message;
}

// No one play is that of the record: the interval holds both, or there is no answer.
TEST(GapTraverse, APlayThatStepsIsNeitherOfThemAlone) {
  for (const double load_step : {0.0, 7e-6}) {
    Servo servo;
    servo.load_step = load_step, servo.later = 1.2e-3;
    const Estimate e = estimate_gap_traverse(servo.record(), declared());
    EXPECT_TRUE(e.status != Status::ok || (e.angle_lower <= servo.gap && servo.later <= e.angle_upper))
        << e.angle_lower << " to " << e.angle_upper << ": " << e.message;
  }
}

// One flank is pressed throughout: its deflection says nothing of the other.
class GapTraverseUnderAWeight : public testing::TestWithParam<double> {};

TEST_P(GapTraverseUnderAWeight, OneFlankAloneIsNoPlay) {
  Servo servo;
  servo.load_step = 7e-6, servo.gravity = GetParam();
  const Estimate e = estimate_gap_traverse(servo.record(), declared());
  EXPECT_NE(e.status, Status::ok) << e.backlash_angle << " " << e.message;
}

INSTANTIATE_TEST_SUITE_P(Servos, GapTraverseUnderAWeight, testing::Values(600.0, 1500.0));

// A declared weight, a third larger than declared, leaves the other flank a part of the time: what the record
// says of it counts, and not that it might be larger still.
TEST(GapTraverse, AWeightMayLeaveTheOtherFlankLittleTime) {
  Servo servo;
  servo.load_step = 7e-6, servo.gravity = 160, servo.duration = 10;
  GapTraverseSettings settings = declared();
  settings.load_torque = [](double) { return 120.0; };
  for (const bool load : {true, false}) {
    record::Record record = servo.record();
    if (!load) record.column(record::Channel::load_position).clear();
    const Estimate e = estimate_gap_traverse(record, settings);
    ASSERT_EQ(e.status, Status::ok) << e.message;
    EXPECT_LE(e.angle_lower, servo.gap) << e.message;
    EXPECT_GE(e.angle_upper, servo.gap) << e.message;
  }
}

TEST(GapTraverse, HoldsWithEffectsThatNobodyDeclares) {
  Servo servo;
  servo.gravity = 40, servo.cogging = 15, servo.noise = 10;
  expect_gap(servo, estimate_gap_traverse(servo.record(), declared()));
}

// Of a motor that hardly accelerates the second difference of the positions is noise, which must not be taken
// for a smaller inertia; nor may a friction of a third more than declared be taken for a press on a flank.
TEST(GapTraverse, HoldsInSmoothMotionWithMoreFrictionThanDeclared) {
  Servo servo;
  servo.smooth = true, servo.motor_coulomb = 80;
  expect_gap(servo, estimate_gap_traverse(servo.record(), declared()));
}

class GapTraverseOfNoPlay : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(GapTraverseOfNoPlay, IsNotReportedAsSome) {
  Servo servo;
  std::tie(servo.gap, servo.step) = GetParam();
  servo.duration = 10;
  const Estimate e = estimate_gap_traverse(servo.record(), declared());
  EXPECT_TRUE(e.status != Status::ok || (e.angle_lower <= servo.gap && servo.gap <= e.angle_upper))
      << e.message << " " << e.angle_lower << " to " << e.angle_upper;
}

INSTANTIATE_TEST_SUITE_P(Servos, GapTraverseOfNoPlay,
                         testing::Combine(testing::Values(0.0, 1e-5),
                                          testing::Values(8.7e-7, 1.4e-5)));  // 12 bits behind 110 : 1

TEST(GapTraverse, HoldsForTeethAfterHertz) {
  for (const double noise : {2.0, 60.0}) {
    Servo servo;
    servo.hertz = 300, servo.noise = noise;
    const Estimate e = estimate_gap_traverse(servo.record(), declared());
    ASSERT_EQ(e.status, Status::ok) << e.message;
    EXPECT_LT(e.angle_lower, servo.gap) << e.message;
    EXPECT_GT(e.angle_upper, servo.gap) << e.message;
    EXPECT_LT(e.angle_upper, 3 * e.angle_lower) << e.message;  // and says something
  }
}

// Declared as they are: they count as what they are under the torque of the record.
TEST(GapTraverse, TeethThatAreNoSpringMayBeDeclared) {
  Servo servo;
  servo.hertz = 300;
  GapTraverseSettings s = declared();
  s.flank = {};
  s.flank_under = [&](double torque) {
    const double there = servo.exponent * servo.hertz / servo.stiffness;
    return GapTraverseSettings::Flank{torque / (there * std::pow(torque / servo.hertz, 1 / servo.exponent)),
                                      torque * servo.damping / servo.hertz};
  };
  for (const double load_step : {0.0, 7e-6}) {
    servo.load_step = load_step;
    expect_gap(servo, estimate_gap_traverse(servo.record(), s));
  }
  record::Record without = servo.record();
  without.column(record::Channel::motor_torque).clear();
  EXPECT_NE(estimate_gap_traverse(without, s).message.find("needs motor_torque"), std::string::npos);
}

// Commissioned, a spring: the law of its teeth was fitted, and is not asked for again. The last digit of a
// value moves nothing.
TEST(GapTraverse, TheLawOfACommissionedMachineIsHeld) {
  Servo servo;
  servo.load_step = 7e-6, servo.duration = 8;
  const record::Record record = servo.record();
  GapTraverseSettings s = declared();
  const Estimate unknown = estimate_gap_traverse(record, s);
  s.unexplained = 1e-7;
  double play = 0;
  for (const double last_digit : {0.0, 1e-11}) {
    s.flank.stiffness = 4.6e5 * (1 + last_digit);
    const Estimate e = estimate_gap_traverse(record, s);
    expect_gap(servo, e, 0.01);
    EXPECT_LT(e.angle_upper - e.angle_lower, 0.5 * (unknown.angle_upper - unknown.angle_lower));
    if (last_digit == 0)
      play = e.backlash_angle;
    else
      EXPECT_NEAR(e.backlash_angle, play, 1e-3 * play);  // choice; 1e-4 were seen
  }
}

// Teeth that begin more softly than Hertz's, as those that harden, look like a wider gap: the interval holds
// both.
TEST(GapTraverse, HoldsForTeethSofterAtFirstThanAnyContact) {
  for (const double noise : {2.0, 20.0})
    for (const double exponent : {1.75, 2.0}) {
      Servo servo;
      servo.noise = noise, servo.hertz = 300, servo.exponent = exponent;
      const Estimate e = estimate_gap_traverse(servo.record(), declared());
      EXPECT_TRUE(e.status != Status::ok || (e.angle_lower <= servo.gap && servo.gap <= e.angle_upper))
          << exponent << " " << noise << ": " << e.angle_lower << " to " << e.angle_upper;
    }
}

TEST(GapTraverse, AngleIsPlayOverBaseRadius) {
  GapTraverseSettings s = declared();
  s.base_radius = 0.02;
  const Estimate e = estimate_gap_traverse(Servo().record(), s);
  ASSERT_EQ(e.status, Status::ok) << e.message;
  EXPECT_DOUBLE_EQ(e.backlash, 0.02 * e.backlash_angle);
  EXPECT_DOUBLE_EQ(e.upper, 0.02 * e.angle_upper);
}

TEST(GapTraverse, SaysWhatMotionIsMissing) {
  Servo servo;
  servo.duration = 3;
  const Estimate e = estimate_gap_traverse(servo.record(), declared());
  EXPECT_EQ(e.status, Status::insufficient_data);
  EXPECT_NE(e.message.find("moves that reverse with more than"), std::string::npos) << e.message;
}

TEST(GapTraverse, AMachineThatIsNotTheDeclaredOneIsRefused) {
  Servo servo;
  servo.motor_inertia = 40;  // six times the declared one
  const Estimate e = estimate_gap_traverse(servo.record(), declared());
  EXPECT_EQ(e.status, Status::out_of_domain) << e.message << " " << e.backlash_angle;
}

TEST(GapTraverse, RecordsThatCannotServeAreAnswered) {
  const record::Record good = Servo().record();
  const auto answer = [&](const std::function<void(record::Record&)>& spoil) {
    record::Record r = good;
    spoil(r);
    return estimate_gap_traverse(r, declared());
  };
  using record::Channel;
  EXPECT_EQ(answer([](auto& r) { r.column(Channel::motor_torque).clear(); }).status,
            Status::insufficient_data);
  EXPECT_EQ(answer([](auto& r) { r.column(Channel::motor_position)[7] = kNaN; }).status,
            Status::insufficient_data);
  EXPECT_EQ(answer([](auto& r) {
              for (std::size_t i = 1; i < r.size(); i += 2) r.time[i] += 3e-4;  // of 1e-3: the stamps alone
            }).status,
            Status::ok);
  EXPECT_EQ(answer([](auto& r) {
              for (double& q : r.column(Channel::motor_position)) q = 0.1;
            }).status,
            Status::insufficient_data);
  Servo both;
  both.load_step = 7e-6;
  record::Record r = both.record();
  r.column(Channel::load_position) = r.column(Channel::motor_position);
  EXPECT_EQ(estimate_gap_traverse(r, declared()).status, Status::insufficient_data);
  for (double& q : r.column(Channel::load_position)) q = 0.1;
  EXPECT_EQ(estimate_gap_traverse(r, declared()).status, Status::insufficient_data);
  const Estimate coarse = estimate_gap_traverse(Servo().record(100), declared());
  EXPECT_EQ(coarse.status, Status::out_of_domain);
  EXPECT_NE(coarse.message.find("does not resolve"), std::string::npos) << coarse.message;
}

// What the joint moves while the time of a sample is not known widens the interval, or is too much: at rms
// speeds of these motions of 0.3 to 3 rad/s a hundred thousandth of a second is 3 to 30 urad, and a tenth of
// one is more than all of the play.
TEST(GapTraverse, TimesThatAreNotKnownWidenTheIntervalOrAreTooMuch) {
  Servo servo;
  servo.load_step = 7e-6;
  record::Record r = servo.record();
  r.unsure_time = 0;
  const Estimate sure = estimate_gap_traverse(r, declared());
  r.unsure_time = 1e-5;
  const Estimate unsure = estimate_gap_traverse(r, declared());
  ASSERT_EQ(sure.status, Status::ok) << sure.message;
  ASSERT_EQ(unsure.status, Status::ok) << unsure.message;
  EXPECT_EQ(unsure.backlash_angle, sure.backlash_angle);
  EXPECT_LT(unsure.angle_lower, sure.angle_lower);
  EXPECT_GT(unsure.angle_upper, sure.angle_upper);
  r.unsure_time = 0.1;
  const Estimate refused = estimate_gap_traverse(r, declared());
  EXPECT_EQ(refused.status, Status::out_of_domain);
  EXPECT_NE(refused.message.find("stamps of the sampling"), std::string::npos) << refused.message;
  r.column(record::Channel::load_position).clear();
  EXPECT_EQ(estimate_gap_traverse(r, declared()).message, refused.message);
}

TEST(GapTraverse, SettingsOutOfRangeThrow) {
  const record::Record record;
  using Settings = GapTraverseSettings;
  for (double& (*value)(Settings&) : {+[](Settings& s) -> double& { return s.motor_inertia; },
                                      +[](Settings& s) -> double& { return s.load_inertia; },
                                      +[](Settings& s) -> double& { return s.flank.stiffness; },
                                      +[](Settings& s) -> double& { return s.flank.damping; },
                                      +[](Settings& s) -> double& { return s.gap; },
                                      +[](Settings& s) -> double& { return s.motor_damping; }})
    for (const double wrong : {-1.0, kNaN}) {
      Settings s = declared();
      value(s) = wrong;
      EXPECT_THROW(estimate_gap_traverse(record, s), InvalidParameter);
    }
}

}  // namespace
}  // namespace backlash::diagnosis
