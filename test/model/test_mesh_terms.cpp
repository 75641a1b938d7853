// SPDX-License-Identifier: BSD-3-Clause
// Terms that shape the flanks: openings and slopes, what they make of the mesh, and that they cost no energy.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::model {
namespace {

using TermPointer = std::shared_ptr<const Term>;

TermPointer term(const std::string& text) {
  return read_term(YamlReader::from_text("{" + text + "}", "rig.yaml"));
}

constexpr double kHalf = 2e-3;  // rad

FlankShift shift(const TermPointer& term, int side, double load, double motor = 0, double torque = 0) {
  FlankShift sum;
  term->shape({motor, load, kHalf, torque, side}, sum);
  return sum;
}

const char* const kVarying = "id: varying_backlash, amplitude: 0.15, order: 3, phase: 0.4";
const char* const kError = "id: transmission_error, amplitude: 3e-4, order: 5, phase: -1";
const char* const kEccentric =
    "id: eccentricity, eccentricity: 5e-5, base_radius: 0.04, pressure_angle: 0.35, order: 2.5, phase: 0.8";
const char* const kMap =
    "id: backlash_map, positions: [-1, 0.5, 2, 4], backlash: [4e-3, 5e-3, 3e-3, 6e-3], "
    "centre: [0, 1e-4, -2e-4, 3e-4]";
const char* const kRadial =
    "id: radial_compliance, compliance: 2e-8, base_radius: 0.04, pressure_angle: 0.35";
const char* const kRatio = "id: varying_reduction_ratio, change: 1e-5";

TEST(MeshTerms, OpeningsByHand) {
  for (int side : {1, -1}) {
    // 0.15 of the half gap times sin(3 * 0.7 + 0.4)
    EXPECT_NEAR(shift(term(kVarying), side, 0.7).opening, 0.15 * kHalf * std::sin(2.5), 1e-18);
    EXPECT_NEAR(shift(term(kError), side, 0.7).opening, -side * 3e-4 * std::sin(2.5), 1e-18);
    EXPECT_NEAR(shift(term(kEccentric), side, 0.7).opening,
                5e-5 / 0.04 * (std::sin(0.35) * std::cos(2.55) - side * std::cos(0.35) * std::sin(2.55)),
                1e-17);
    // a third of the way from 0.5 to 2
    EXPECT_NEAR(shift(term(kMap), side, 1).opening,
                0.5 * (5e-3 - 2e-3 / 3) - kHalf + side * (1e-4 - 3e-4 / 3), 1e-17);
    EXPECT_NEAR(shift(term(kRadial), side, 0.7, 0, side * 50).opening,
                2e-8 * 50 * std::pow(std::sin(0.35) / 0.04, 2), 1e-18);
    EXPECT_NEAR(shift(term(kRatio), side, 0.7, 0.9, side * 50).opening, -1e-5 * 50 * 0.9, 1e-18);
  }
}

TEST(MeshTerms, SlopesAreThoseOfTheOpening) {
  const double d = 1e-6;
  for (const char* text : {kVarying, kError, kEccentric, kMap, kRadial, kRatio}) {
    const TermPointer t = term(text);
    EXPECT_TRUE(t->shapes_flanks());
    EXPECT_FALSE(t->has_dry_friction());
    for (int side : {1, -1})
      for (double q = -9.03; q < 9; q += 0.41) {
        const double m = 0.3 - q, torque = side * 40;
        const FlankShift at = shift(t, side, q, m, torque);
        const auto opening = [&](double load, double motor) {
          return shift(t, side, load, motor, torque).opening;
        };
        // rounding: 1e-16 of 1e-3 over 1e-6; curvature times d^2
        EXPECT_NEAR(at.load_slope, (opening(q + d, m) - opening(q - d, m)) / (2 * d), 1e-9) << text << q;
        EXPECT_NEAR(at.motor_slope, (opening(q, m + d) - opening(q, m - d)) / (2 * d), 1e-9) << text << q;
      }
  }
}

TEST(MeshTerms, AnEccentricWheelIsATransmissionErrorAndAVaryingGap) {
  const double eps = 5e-5, pitch = 0.04 / std::cos(0.35), n = 2.5, p = 0.8;
  const TermPointer wheel = term(kEccentric);
  double widest = -1, narrowest = 1, farthest = 0;
  for (int i = 0; i < 10000; ++i) {
    const double q = i * 2 * M_PI / n / 10000;
    const FlankShift forward = shift(wheel, 1, q), back = shift(wheel, -1, q);
    const double gap = forward.opening + back.opening, middle = 0.5 * (forward.opening - back.opening);
    EXPECT_NEAR(gap, 2 * eps * std::tan(0.35) / pitch * std::cos(n * q + p), 1e-16);
    EXPECT_NEAR(middle, -eps / pitch * std::sin(n * q + p), 1e-16);
    widest = std::max(widest, gap), narrowest = std::min(narrowest, gap);
    farthest = std::max(farthest, std::fabs(middle));
  }
  EXPECT_NEAR(widest - narrowest, 4 * eps * std::tan(0.35) / pitch, 1e-9);  // 1 - cos of a 10000th of a turn
  EXPECT_NEAR(farthest, eps / pitch, 1e-9);
}

std::string list(int count, const std::function<double(double)>& f) {
  std::string text = "[";
  for (int i = 0; i < count; ++i) {
    char number[40];
    std::snprintf(number, sizeof number, "%s%.17g", i ? ", " : "", f(2 * M_PI * i / count - 1));
    text += number;
  }
  return text + "]";
}

TEST(MeshTerms, AFineMapIsTheFourierTerm) {
  const int count = 3600;
  const TermPointer fourier = term(kVarying);
  const TermPointer map =
      term("id: backlash_map, positions: " + list(count, [](double q) { return q; }) + ", backlash: " +
           list(count, [](double q) { return 2 * kHalf * (1 + 0.15 * std::sin(3 * q + 0.4)); }) +
           ", centre: " + list(count, [](double) { return 0.0; }));
  const double step = 2 * M_PI / count, curvature = kHalf * 0.15 * 9;
  for (int side : {1, -1})
    for (double q = -20; q < 20; q += 0.0317) {
      const FlankShift a = shift(fourier, side, q), b = shift(map, side, q);
      ASSERT_NEAR(a.opening, b.opening, curvature * step * step / 8 + 1e-16) << q;  // of linear interpolation
      ASSERT_NEAR(a.load_slope, b.load_slope, curvature * step) << q;
    }
}

TEST(MeshTerms, AMapGoesRoundTheTurn) {
  const TermPointer map = term(kMap);
  const double turn = 2 * M_PI;
  // the last segment: from 4 to -1 + turn, 1.28 rad wide, 6e-3 to 4e-3
  const double half_way = 0.5 * (4 - 1 + turn);
  EXPECT_NEAR(shift(map, 1, half_way).opening, 0.5 * 5e-3 - kHalf + 1.5e-4, 1e-17);
  EXPECT_NEAR(shift(map, -1, half_way - 3 * turn).opening, 0.5 * 5e-3 - kHalf - 1.5e-4, 1e-16);
  for (int turns = -50; turns <= 50; ++turns)
    for (double q : {-1.0, 0.5, 2.0, 4.0}) {
      const double expected[] = {4e-3, 5e-3, 3e-3, 6e-3};
      const int i = q < 0 ? 0 : q < 1 ? 1 : q < 3 ? 2 : 3;
      double at = q + turns * turn;
      for (int side : {1, -1}) {  // and a rounding to either side: continuous
        at = std::nextafter(at, side * 1e3);
        const double gap = shift(map, 1, at).opening + shift(map, -1, at).opening + 2 * kHalf;
        ASSERT_NEAR(gap, expected[i], 1e-15) << q << " + " << turns << " turns";
      }
    }
}

/// Found by search: less than whole turns from the first position by a rounding, where their quotient is
/// whole.
TEST(MeshTerms, AMapHasNoHoleAtItsFirstPosition) {
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const double first = random.uniform(-10, 10);
    char text[200];
    std::snprintf(text, sizeof text,
                  "id: backlash_map, positions: [%.17g, %.17g], backlash: [2e-3, 4e-3], centre: [0, 0]",
                  first, first + 3);
    const TermPointer map = term(text);
    for (int turns = -20; turns <= 20; ++turns) {
      double q = first + turns * (2 * M_PI);
      for (int ulp = 0; ulp < 3; ++ulp, q = std::nextafter(q, -1e9))
        ASSERT_NEAR(shift(map, 1, q).opening, 1e-3 - kHalf, 1e-15) << first << ", " << turns;
    }
  }
}

/// Two free inertias without friction; angular mesh.
Rig free_rig(const std::vector<std::string>& terms, double stiffness = 4e4) {
  Rig rig;
  rig.motor.inertia = 2;
  rig.link.inertia = 5;
  rig.mesh.backlash = 2 * kHalf;
  rig.mesh.contact = make_contact_law("linear", {{"stiffness", stiffness}, {"damping", 0}});
  for (const std::string& text : terms) rig.terms.push_back(term(text));
  return rig;
}

double torque_on(const GearTrain& train, double motor, double load, int node) {
  const double state[] = {motor, load, 0, 0};
  double rate[4];
  train.derivative(0, state, 0.0, rate);
  return rate[2 + node] * (node == 0 ? 2 : 5);
}

// Torques are the slopes of the elastic energy, which the test makes up from the openings.
TEST(MeshTerms, TorquesAreTheSlopesOfTheEnergy) {
  for (const char* text : {kVarying, kError, kEccentric, kMap}) {
    const GearTrain train(free_rig({text}));
    const TermPointer t = term(text);
    const auto energy = [&](double motor, double load) {
      double sum = 0;
      for (int side : {1, -1}) {
        const double depth = side * (motor - load) - kHalf - shift(t, side, load, motor).opening;
        if (depth > 0) sum += 0.5 * 4e4 * depth * depth;
      }
      return sum;
    };
    int pressed = 0;
    for (double load = -7.013; load < 7; load += 0.1)
      for (double twist : {-6e-3, -2.2e-3, 0.0, 2.2e-3, 6e-3}) {
        const double motor = load + twist, d = 1e-7;
        pressed += energy(motor, load) > 0;
        const double on_motor = -(energy(motor + d, load) - energy(motor - d, load)) / (2 * d);
        const double on_load = -(energy(motor, load + d) - energy(motor, load - d)) / (2 * d);
        // rounding: 1e-15 rad of position times 4e4 N m/rad times depth, over d; and a touch within d
        EXPECT_NEAR(torque_on(train, motor, load, 0), on_motor, 1e-3) << text << " " << load;
        EXPECT_NEAR(torque_on(train, motor, load, 1), on_load, 1e-3) << text << " " << load;
        const double state[] = {motor, load, 0, 0};
        EXPECT_NEAR(train.energy(state), energy(motor, load), 1e-15);
      }
    EXPECT_GT(pressed, 200);
  }
}

// Rattling round and round. Kinetic and elastic energy from the states and the openings alone.
TEST(MeshTerms, NoEnergyIsMadeOrLost) {
  for (const char* text : {kVarying, kError, kEccentric, kMap}) {
    const TermPointer t = term(text);
    simulation::Plant plant(free_rig({text}), test::constant(0), test::solver(1e-11));
    simulation::Plant::State start{};
    start[2] = 3.2, start[3] = 3;
    plant.set_state(start);
    const double before = 0.5 * 2 * 3.2 * 3.2 + 0.5 * 5 * 9;
    double most_elastic = 0;
    for (int k = 1; k <= 2000; ++k) {
      plant.advance_to(k * 2e-3);
      const auto& s = plant.state();
      double elastic = 0;
      for (int side : {1, -1}) {
        const double depth = side * (s[0] - s[1]) - kHalf - shift(t, side, s[1], s[0]).opening;
        if (depth > 0) elastic += 0.5 * 4e4 * depth * depth;
      }
      most_elastic = std::max(most_elastic, elastic);
      // the map has corners, which the solver steps across
      ASSERT_NEAR(0.5 * 2 * s[2] * s[2] + 0.5 * 5 * s[3] * s[3] + elastic, before, 1e-7 * before) << text;
    }
    EXPECT_GT(most_elastic, 1e-3);
    EXPECT_GT(plant.state()[1], 11);  // rad: about two turns
  }
}

TEST(MeshTerms, RadialComplianceIsASpringInSeries) {
  const double k = 4e4, series = 0.04 * 0.04 / (2e-8 * std::pow(std::sin(0.35), 2));  // N m/rad
  for (double factor : {1.0, 300.0}) {  // of the compliance: softer than the teeth by 450
    const double total = 1 / (1 / k + factor / series);
    const std::string text = "id: radial_compliance, base_radius: 0.04, pressure_angle: 0.35, compliance: ";
    const GearTrain train(free_rig({text + std::to_string(factor * 2e-2) + "e-6"}));
    for (double depth : {1e-9, 1e-4, 3e-3})
      for (int side : {1, -1}) {
        const double torque = total * depth;
        EXPECT_NEAR(torque_on(train, side * (kHalf + depth), 0, 0), -side * torque, 1e-6 * torque);
        EXPECT_NEAR(torque_on(train, side * (kHalf + depth), 0, 1), side * torque, 1e-6 * torque);
        const double state[] = {side * (kHalf + depth), 0, 0, 0};
        EXPECT_NEAR(train.energy(state), 0.5 * torque * torque / k,
                    1e-6 * torque * torque / k);  // of the teeth
      }
    EXPECT_EQ(torque_on(train, kHalf, 0, 0), 0);
  }
}

// A law that is not linear: the torque again solves T = r F(x - o(T)), here by bisection.
TEST(MeshTerms, FlanksThatFollowTheirTorqueAreInEquilibrium) {
  for (const char* text : {kRadial, kRatio, "id: varying_reduction_ratio, change: -1e-5"}) {
    Rig rig = free_rig({text});
    rig.mesh.base_radius = 0.04;
    rig.mesh.backlash = 2 * kHalf * 0.04;
    rig.mesh.contact = make_contact_law("power_law", {{"stiffness", 1e9}, {"exponent", 1.5}});
    const GearTrain train(rig);
    const TermPointer t = term(text);
    for (double motor : {0.01, 0.05, -0.02, -0.04}) {
      const int side = motor > 0 ? 1 : -1;
      for (double depth : {1e-5, 1e-4, 1e-3}) {
        const double load = motor - side * (kHalf + depth);
        const auto excess = [&](double torque) {
          const double p = 0.04 * (depth - shift(t, side, load, motor, side * torque).opening);
          return 0.04 * (p > 0 ? 1e9 * std::pow(p, 1.5) : 0) - torque;
        };
        double low = 0, high = 1e4;
        for (int i = 0; i < 200; ++i) (excess(0.5 * (low + high)) > 0 ? low : high) = 0.5 * (low + high);
        const double slope = shift(t, side, load, motor, side * low).motor_slope;
        EXPECT_NEAR(torque_on(train, motor, load, 1), side * low, 1e-9 * low) << text << motor << depth;
        EXPECT_NEAR(torque_on(train, motor, load, 0), -low * (side - slope), 1e-9 * low);
      }
    }
  }
}

// a q k = 1.2: the flank advances faster than the teeth give way. No finite torque; no wrong one either.
TEST(MeshTerms, WithoutEquilibriumTheRateIsNotFinite) {
  const GearTrain train(free_rig({kRatio}));
  EXPECT_TRUE(std::isfinite(torque_on(train, 2.0, 2.0 - kHalf - 1e-4, 1)));
  EXPECT_FALSE(std::isfinite(torque_on(train, 3.0, 3.0 - kHalf - 1e-4, 1)));
  EXPECT_EQ(torque_on(train, 3.0, 3.0, 1), 0);
}

TEST(MeshTerms, AGapThatATermClosesPressesBothFlanks) {
  const GearTrain train(
      free_rig({"id: varying_backlash, amplitude: -1.5, order: 1, phase: 1.5707963267948966"}));
  // at q = 0 the gap is -0.5 of its size: each flank 1e-3 rad deep in the middle
  const double state[] = {0, 0, 0, 0}, squeezed = 0.5 * kHalf;
  EXPECT_NEAR(torque_on(train, 0, 0, 0), 0, 1e-12);
  EXPECT_NEAR(train.energy(state), 4e4 * squeezed * squeezed, 1e-12);
  const double d = 1e-4;  // both flanks act: twice the stiffness
  EXPECT_NEAR(torque_on(train, d, 0, 0), -2 * 4e4 * d, 1e-9);
}

TEST(MeshTerms, TermsAddUp) {
  const GearTrain both(free_rig({kError, kVarying}));
  for (int side : {1, -1})
    for (double q : {0.3, 1.7, -4.0}) {
      const double opening = shift(term(kError), side, q).opening + shift(term(kVarying), side, q).opening;
      const double motor = q + side * (kHalf + opening + 1e-4);
      EXPECT_NEAR(torque_on(both, motor, q, 0), -side * 4e4 * 1e-4, 1e-7);
    }
}

TEST(MeshTerms, TheStartInTheGapMovesBothWalls) {
  for (double s : {-1.0, -0.25, 0.0, 0.6, 1.0}) {
    Rig rig = free_rig({});
    rig.mesh.start_in_gap = s;
    const GearTrain train(rig);
    const double upper = kHalf * (1 - s), lower = -kHalf * (1 + s), d = 1e-7;
    EXPECT_EQ(torque_on(train, upper - d, 0, 0), 0) << s;
    EXPECT_NEAR(torque_on(train, upper + d, 0, 0), -4e4 * d, 1e-9);
    EXPECT_EQ(torque_on(train, lower + d, 0, 0), 0) << s;
    EXPECT_NEAR(torque_on(train, lower - d, 0, 0), 4e4 * d, 1e-9);
  }
}

// With a law of impacts: the touch is where the shaped flank is, and the jump acts along its slope, so that
// energy and the momentum of that direction are kept.
TEST(MeshTerms, AnElasticImpactOnASlopeKeepsEnergyAndItsMomentum) {
  const TermPointer steep =
      term("id: transmission_error, amplitude: 2e-3, order: 40, phase: 0.3");  // slope 0.08
  Rig rig = free_rig({});
  rig.terms = {steep};
  rig.mesh.contact = make_contact_law(
      "stereomechanical", {{"restitution", 1}, {"resting_speed", 1e-6}, {"stiffness", 4e4}, {"damping", 0}});
  for (const std::string& method : simulation::integrator_methods()) {
    simulation::Plant plant(rig, test::constant(0), test::solver(1e-10, method));
    simulation::Plant::State start{};
    start[2] = 0.2, start[3] = -0.1;
    plant.set_state(start);
    const auto depth = [&](double t) { return 0.3 * t - kHalf - shift(steep, 1, -0.1 * t).opening; };
    double low = 0, high = 0.02;
    ASSERT_GT(depth(high), 0);
    for (int i = 0; i < 100; ++i) (depth(0.5 * (low + high)) > 0 ? high : low) = 0.5 * (low + high);
    plant.advance_to(low + 1e-5);
    const double slope = shift(steep, 1, -0.1 * low).load_slope, wm = plant.state()[2], wl = plant.state()[3];
    ASSERT_NE(wm, 0.2) << method;
    EXPECT_NEAR(2 * wm * wm + 5 * wl * wl, 2 * 0.04 + 5 * 0.01, 1e-12) << method;
    EXPECT_NEAR(5 * (wl + 0.1) / (2 * (0.2 - wm)), 1 + slope, 1e-8) << method;
    EXPECT_GT(std::fabs(slope), 0.05);
  }
}

// Where neither flank touches, the events are the penetrations and the ends of their approaches.
TEST(MeshTerms, TheTurningPointsAreThoseOfEachFlank) {
  Rig rig = free_rig({kEccentric});
  rig.mesh.contact = make_contact_law(
      "lankarani_nikravesh",
      {{"stiffness", 1e8}, {"exponent", 1.5}, {"restitution", 0.7}, {"minimum_speed", 1e-4}});
  GearTrain train(rig);
  double state[] = {0.3, 0.3003, 0.2, -0.4}, values[GearTrain::kContactEvents];
  train.begin_contact(state);
  train.contact_events(state, values);
  const double d = 1e-6;
  const auto depth = [&](int side, double t) {
    const double motor = state[0] + t * state[2], load = state[1] + t * state[3];
    return side * (motor - load) - kHalf - shift(term(kEccentric), side, load, motor).opening;
  };
  EXPECT_NEAR(values[0], depth(1, 0), 1e-16);
  EXPECT_NEAR(values[1], depth(-1, 0), 1e-16);
  EXPECT_NEAR(values[2], -(depth(-1, d) - depth(-1, -d)) / (2 * d), 1e-9);  // rounding over d
  EXPECT_NEAR(values[3], -(depth(1, d) - depth(1, -d)) / (2 * d), 1e-9);
}

TEST(MeshTerms, RefusalsNameWhatIsWrong) {
  const struct {
    const char* text;
    const char* message;
  } cases[] = {
      {"id: varying_backlash, amplitude: 0.1, phase: 0", "order: is missing"},
      {"id: varying_backlash, amplitude: 0.1, order: 0, phase: 0", "order = 0: must be > 0"},
      {"id: transmission_error, order: 1, phase: 0", "amplitude: is missing"},
      {"id: eccentricity, eccentricity: -1, base_radius: 1, pressure_angle: 0.3, order: 1, phase: 0",
       "eccentricity = -1: must be >= 0"},
      {"id: radial_compliance, compliance: 1, base_radius: 0, pressure_angle: 0.3",
       "base_radius = 0: must be > 0"},
      {"id: radial_compliance, compliance: 1, base_radius: 1, pressure_angle: 20",
       "pressure_angle = 20: must be"},
      {"id: varying_reduction_ratio, change: much", "change = much: not a number"},
      {"id: backlash_map, positions: [0, 1], backlash: 3, centre: [0, 0]", "backlash = 3: "},
      {"id: backlash_map, positions: [0, 1], backlash: [1, -2], centre: [0, 0]", "-2: must be >= 0"},
      {"id: backlash_map, positions: [0], backlash: [1], centre: [0]",
       "rig.yaml:1: positions = [...]: needs at least two points, not 1"},
      {"id: backlash_map, positions: [0, 1], backlash: [1], centre: [0, 0]",
       "backlash = [...]: one value per position, not 1"},
      {"id: backlash_map, positions: [0, 1], backlash: [1, 1], centre: [0]",
       "centre = [...]: one value per position, not 1"},
      {"id: backlash_map, positions: [0, 1, 1], backlash: [1, 1, 1], centre: [0, 0, 0]",
       "positions = [...]: must increase, not 1"},
      {"id: backlash_map, positions: [0, 6.2831853071795865], backlash: [1, 1], centre: [0, 0]",
       "must lie within one turn"},
  };
  for (const auto& c : cases) try {
      term(c.text);
      ADD_FAILURE() << "accepted: " << c.text;
    } catch (const std::exception& error) {
      EXPECT_NE(std::string(error.what()).find(c.message), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace backlash::model
