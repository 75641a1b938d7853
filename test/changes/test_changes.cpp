// SPDX-License-Identifier: BSD-3-Clause
// Changes of a machine that the test itself writes down: the inverse dynamics of a joint with gravity and
// friction along sums of sines, with white noise of the torque.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/changes/changes.h"

namespace backlash::changes {
namespace {

constexpr double kRate = 125;    // Hz
constexpr double kNoise = 0.03;  // N m

struct Motion {
  double t, q, w, a;
};

/// Torque that is added to the healthy machine's.
using Added = double (*)(const Motion&);

double sign(double x) {
  return x < 0 ? -1 : 1;
}

double healthy_torque(const Motion& m) {
  const double warm = 1 + 0.3 * std::exp(-m.t / 80);
  return 0.45 * m.a + warm * (1.1 * m.w + 0.75 * sign(m.w)) + 3 * std::sin(m.q);
}

struct Travel {
  double reach = 1;   // over 1.7 rad
  double middle = 0;  // rad
};

record::Record made(unsigned seed, double duration, Added added, const Travel& travel = {}) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, kNoise);
  std::uniform_real_distribution<double> phase(0, 2 * M_PI);
  const double p[] = {phase(random), phase(random), phase(random)}, f[] = {0.11, 0.17, 0.29},
               a[] = {0.8, 0.6, 0.3};
  record::Record r;
  r.name = "made";
  for (int k = 0; k < int(duration * kRate); ++k) {
    Motion m{k / kRate, travel.middle, 0, 0};
    for (int i = 0; i < 3; ++i) {
      const double w = 2 * M_PI * f[i];
      m.q += travel.reach * a[i] * std::sin(w * m.t + p[i]);
      m.w += travel.reach * a[i] * w * std::cos(w * m.t + p[i]);
      m.a -= travel.reach * a[i] * w * w * std::sin(w * m.t + p[i]);
    }
    r.time.push_back(m.t);
    r.column(record::Channel::motor_position).push_back(m.q);
    r.column(record::Channel::motor_torque).push_back(healthy_torque(m) + added(m) + noise(random));
  }
  return r;
}

model::Rig one_inertia() {
  model::Rig rig;
  rig.mesh.rigid = true;
  return rig;
}

double nothing(const Motion&) {
  return 0;
}

Changes changes_of(const record::Record& record, double false_alarms_per_hour = 1.0 / 720) {
  ChangeSettings settings;
  settings.false_alarms_per_hour = false_alarms_per_hour;
  return detect_changes(one_inertia(), {made(1, 200, nothing), made(2, 200, nothing)}, record, settings);
}

TEST(Changes, NothingIsReportedOfHealthyRecords) {
  // Ten records of 200 s at one false alarm a month: 1 in 1300 would be chance.
  for (unsigned seed = 10; seed < 20; ++seed) {
    const Changes found = changes_of(made(seed, 200, nothing));
    EXPECT_TRUE(found.changes.empty()) << seed;
    EXPECT_EQ(found.cannot_tell, "") << seed;
  }
}

TEST(Changes, ThresholdIsWhatTheRateAsksFor) {
  const Changes often = changes_of(made(10, 200, nothing), 1),
                seldom = changes_of(made(10, 200, nothing), 0.01);
  EXPECT_EQ(often.windows, seldom.windows);
  // Of one value chance falls as sqrt(x) exp(-x / 2), by a hundred; what else depends on x is slower: 10 %.
  const auto tail = [](double x) { return std::sqrt(x) * std::exp(-x / 2); };
  EXPECT_NEAR(tail(often.threshold) / tail(seldom.threshold), 100, 10);
}

struct Case {
  const char* effect;
  Added added;
  const char* value;
  double size;
};

class ChangesOf : public testing::TestWithParam<Case> {};

TEST_P(ChangesOf, AreNamedWithSizeAndTime) {
  const Changes found = changes_of(made(30, 200, GetParam().added));
  ASSERT_EQ(found.changes.size(), 1u);
  const Change& c = found.changes.front();
  EXPECT_EQ(c.effect, GetParam().effect);
  EXPECT_LE(c.since_from, 120);
  EXPECT_GE(c.since_to, 120);
  EXPECT_LT(c.since_to - c.since_from, 4);  // a reversal each 1 to 3 s hides the onset for that long
  EXPECT_FALSE(c.until);
  for (const ChangeSize& s : c.size)
    if (s.name == GetParam().value) {
      // 3 standard errors: one of the cases in 60 would miss by chance
      EXPECT_NEAR(s.measured.value, GetParam().size, 3 * s.measured.standard_error);
    }
}

constexpr double kOnset = 120;  // s

const Case kCases[] = {
    {"motor_coulomb", [](const Motion& m) { return m.t < kOnset ? 0 : 0.15 * sign(m.w); }, "motor_coulomb",
     0.15},
    {"motor_viscous", [](const Motion& m) { return m.t < kOnset ? 0 : 0.2 * m.w; }, "motor_viscous", 0.2},
    {"motor_inertia", [](const Motion& m) { return m.t < kOnset ? 0 : 0.1 * m.a; }, "motor_inertia", 0.1},
    {"encoder_slip",  // the joint stands 0.05 rad behind what is shown
     [](const Motion& m) { return m.t < kOnset ? 0 : 3 * (std::sin(m.q - 0.05) - std::sin(m.q)); }, "offset",
     0.05},
    {"gravity", [](const Motion& m) { return m.t < kOnset ? 0 : 0.4 * std::sin(m.q + 0.3); }, "amplitude",
     0.4},
    {"cogging", [](const Motion& m) { return m.t < kOnset ? 0 : 0.2 * std::sin(9 * m.q + 1); }, "phase", 1},
    {"asymmetric_coulomb", [](const Motion& m) { return m.t < kOnset ? 0 : 0.2; }, "torque", 0.2},
    {"load_dependent_friction",
     [](const Motion& m) {
       return m.t < kOnset ? 0 : 0.06 * std::fabs(0.45 * m.a + 3 * std::sin(m.q)) * sign(m.w);
     },
     "coefficient", 0.06},
    {"motor_torque_gain",  // all that is recorded is 6 % more
     [](const Motion& m) { return m.t < kOnset ? 0 : 0.06 * healthy_torque(m); }, "gain", 0.06},
};
INSTANTIATE_TEST_SUITE_P(Effects, ChangesOf, testing::ValuesIn(kCases),
                         [](const auto& info) { return info.param.effect; });

// Loss of what the load takes, without the rotor's half of the inertia.
TEST(Changes, FrictionOfTheLoadLeavesOutTheRotor) {
  const Changes found = changes_of(made(30, 200, [](const Motion& m) {
    return m.t < kOnset ? 0 : 0.1 * std::fabs(0.5 * 0.45 * m.a + 3 * std::sin(m.q)) * sign(m.w);
  }));
  ASSERT_EQ(found.changes.size(), 1u);
  const Change& c = found.changes.front();
  EXPECT_EQ(c.effect, "load_dependent_friction");
  EXPECT_NEAR(c.size.front().measured.value, 0.1, 2 * c.size.front().measured.standard_error);
  EXPECT_EQ(c.size.back().name, "rotor_share");
  EXPECT_NEAR(c.size.back().measured.value, 0.5, 2 * c.size.back().measured.standard_error);
}

// From 120 s on the torque is stamped two samples before it acts.
TEST(Changes, ATorqueThatActsLaterIsADelay) {
  constexpr std::size_t kLater = 2;
  record::Record late = made(30, 200, nothing);
  std::vector<double>& torque = late.column(record::Channel::motor_torque);
  for (auto k = std::size_t(kOnset * kRate); k + kLater < torque.size(); ++k) torque[k] = torque[k + kLater];
  const Changes found = changes_of(late);
  ASSERT_EQ(found.changes.size(), 1u);
  const Change& c = found.changes.front();
  EXPECT_EQ(c.effect, "delay");
  EXPECT_LE(c.since_from, 120);
  EXPECT_GE(c.since_to, 120);
  ASSERT_EQ(c.size.size(), 1u);
  EXPECT_NEAR(c.size[0].measured.value, kLater / kRate, 3 * c.size[0].measured.standard_error);
  EXPECT_LT(c.size[0].measured.standard_error, 0.1 * kLater / kRate);
}

TEST(Changes, APayloadIsGravityWithInertia) {
  // At 0.5 m from the axis: m g l = 1.6 N m, m l^2 = 0.08 kg m^2
  const Changes found = changes_of(
      made(30, 200, [](const Motion& m) { return m.t < kOnset ? 0 : 1.6 * std::sin(m.q) + 0.08 * m.a; }));
  ASSERT_EQ(found.changes.size(), 1u);
  const Change& c = found.changes.front();
  EXPECT_EQ(c.effect, "gravity");
  ASSERT_EQ(c.size.size(), 3u);
  EXPECT_NEAR(c.size[0].measured.value, 1.6, 3 * c.size[0].measured.standard_error);
  EXPECT_EQ(c.size[2].name, "inertia");
  EXPECT_NEAR(c.size[2].measured.value, 0.08, 3 * c.size[2].measured.standard_error);
}

// Within 0.6 rad of where the load pulls most its gravity is nearly a constant, and that explains 99 % of
// what gravity does. What it leaves stands out of the noise all the same.
TEST(Changes, AGravityThatIsNearlyAConstantIsNoOffset) {
  const Added carried = [](const Motion& m) { return m.t < kOnset ? 0 : 0.6 * std::sin(m.q); };
  const Changes found = changes_of(made(30, 200, carried, {0.35, M_PI / 2}));
  ASSERT_EQ(found.changes.size(), 1u);
  EXPECT_EQ(found.changes.front().effect, "gravity");
}

std::string text_of(const Changes& found) {
  std::string all;
  for (const Change& c : found.changes)
    all += c.effect + (c.size.empty() ? "" : " " + std::to_string(c.size.front().measured.value)) +
           " since " + std::to_string(c.since) + ", gain " + std::to_string(c.gain) + "; ";
  return all;
}

// Up and down by 3 % of dry friction in two minutes, as oil and temperature have it.
TEST(Changes, FrictionThatWandersHasNone) {
  const Added wander = [](const Motion& m) {
    return 0.03 * 0.75 * sign(m.w) * std::sin(2 * M_PI * m.t / 120 + 1);
  };
  for (unsigned seed = 70; seed < 74; ++seed) EXPECT_EQ(text_of(changes_of(made(seed, 240, wander))), "");
}

// Of a machine with more friction at rest, which falls as it warms up, too: begun cold, and begun warm.
TEST(Changes, AWarmUpOfAllFrictionIsNone) {
  const auto stribeck = [](const Motion& m) {
    return (1 + 0.3 * std::exp(-m.t / 80)) * 0.25 * sign(m.w) * std::exp(-m.w * m.w / (0.1 * 0.1));
  };
  for (const double from : {0, 100})
    EXPECT_TRUE(detect_changes(one_inertia(), {made(1, 240, stribeck), made(2, 240, stribeck)},
                               made(80, 240 + from, stribeck).slice(from, 240 + from))
                    .changes.empty())
        << from;
}

// Friction that grows moving forward only is two effects at once, of which the larger is reported. That it
// shows late, with the next move forward, is in its interval.
TEST(Changes, TheOnsetOfFrictionOfOneDirectionHolds) {
  for (unsigned seed = 90; seed < 96; ++seed) {
    const Changes found =
        changes_of(made(seed, 200, [](const Motion& m) { return m.t < kOnset || m.w < 0 ? 0 : 0.25; }));
    ASSERT_FALSE(found.changes.empty()) << seed;
    EXPECT_LE(found.changes.front().since_from, kOnset) << seed;
    EXPECT_GE(found.changes.front().since_to, kOnset) << seed;
  }
}

TEST(Changes, ThatEndAreReportedWithTheirEnd) {
  const Changes found =
      changes_of(made(40, 200, [](const Motion& m) { return m.t < 70 || m.t > 140 ? 0 : 0.2 * sign(m.w); }));
  ASSERT_EQ(found.changes.size(), 1u);
  EXPECT_EQ(found.changes.front().effect, "motor_coulomb");
  ASSERT_TRUE(found.changes.front().until);
  EXPECT_NEAR(*found.changes.front().until, 140, 1);
}

TEST(Changes, ThatFollowNoEffectAreUnknown) {
  const Changes found =
      changes_of(made(50, 200, [](const Motion& m) { return m.t < kOnset ? 0 : 0.3 * std::sin(3 * m.t); }));
  ASSERT_EQ(found.changes.size(), 1u);
  EXPECT_EQ(found.changes.front().effect, "unknown");
  EXPECT_NEAR(found.changes.front().since, kOnset, 6);
}

double bump(double q) {
  const double x = (q - 0.4) / 0.05;
  return std::exp(-x * x / 2);
}

struct Fault {
  const char* name;
  Added added;
  double forward, backward;
};

class LocalFaultOf : public testing::TestWithParam<Fault> {};

TEST_P(LocalFaultOf, IsReportedWithItsPlace) {
  const Changes found = changes_of(made(30, 200, GetParam().added));
  ASSERT_EQ(found.changes.size(), 1u);
  const Change& c = found.changes.front();
  EXPECT_EQ(c.effect, "local_fault");
  EXPECT_LE(c.since_from, 120);
  EXPECT_GE(c.since_to, 120);
  ASSERT_EQ(c.size.size(), 4u);
  const double truth[] = {GetParam().forward, GetParam().backward, 0.4, 0.05};
  // 3 standard errors: one of the 12 values in 30 sets of noise would miss by chance
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(c.size[i].measured.value, truth[i], 3 * c.size[i].measured.standard_error) << c.size[i].name;
  EXPECT_LT(c.size[2].measured.standard_error, 0.01);
}

const Fault kFaults[] = {
    {"push", [](const Motion& m) { return m.t < kOnset ? 0 : 0.1 * bump(m.q); }, 0.1, 0.1},
    {"friction", [](const Motion& m) { return m.t < kOnset ? 0 : 0.1 * bump(m.q) * sign(m.w); }, 0.1, -0.1},
    {"one_flank", [](const Motion& m) { return m.t < kOnset || m.w < 0 ? 0 : 0.15 * bump(m.q); }, 0.15, 0},
};
INSTANTIATE_TEST_SUITE_P(Kinds, LocalFaultOf, testing::ValuesIn(kFaults),
                         [](const auto& info) { return info.param.name; });

void expect_no_name(Added added) {
  for (const Change& c : changes_of(made(30, 200, added)).changes) EXPECT_EQ(c.effect, "unknown");
}

TEST(Changes, TwoDamagedTeethAreNotOne) {
  expect_no_name([](const Motion& m) { return m.t < kOnset ? 0 : 0.1 * (bump(m.q) + bump(m.q + 0.8)); });
}

TEST(Changes, ARecordThatBeginsWarmOrPausesHasNone) {
  record::Record warm = made(60, 300, nothing).slice(100, 300);
  EXPECT_TRUE(changes_of(warm).changes.empty());
  record::Record pause = made(61, 200, nothing);
  for (double& t : pause.time)
    if (t > 100) t += 90;
  EXPECT_TRUE(changes_of(pause).changes.empty());
}

TEST(Changes, StampsThatMakeNoSenseAreRefused) {
  record::Record jump = made(62, 200, nothing);
  for (double& t : jump.time)
    if (t > 100) t += 3600;
  EXPECT_THROW(changes_of(jump), BadData);
  EXPECT_THROW(changes_of(made(1, 20, nothing)), CannotIdentify);
}

}  // namespace
}  // namespace backlash::changes
