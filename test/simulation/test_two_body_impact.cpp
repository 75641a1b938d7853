// SPDX-License-Identifier: BSD-3-Clause
// Impacts of two free bodies: the restitution that comes out against what each law predicts, tension, lost
// energy.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/restitution.h"
#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

constexpr double kFirst = 0.2, kSecond = 0.3, kReduced = 0.12, kHalfGap = 1e-3, kRadius = 0.02;
constexpr double kStiffness = 1e8;  // N/m^n
const double kSpeeds[] = {0.01, 0.03, 0.1, 0.3, 1.0};

using Law = std::shared_ptr<const model::ContactLaw>;

/// The first body flies at the second, which rests, from the middle of the gap.
class Meeting {
 public:
  Meeting(const Law& law, double speed, double tolerance = 1e-10)
      : plant_(test::two_body_rig(kFirst, kSecond, kHalfGap, law), test::constant(0),
               test::solver(tolerance)),
        touch_(kHalfGap / speed) {
    Plant::State state{};
    state[2] = speed / kRadius;
    plant_.set_state(state);
  }
  void advance_to(double t) { plant_.advance_to(t); }
  double first_position() const { return kRadius * plant_.state()[0]; }
  double penetration() const { return kRadius * (plant_.state()[0] - plant_.state()[1]) - kHalfGap; }
  double first_speed() const { return kRadius * plant_.state()[2]; }
  double second_speed() const { return kRadius * plant_.state()[3]; }
  double rate() const { return first_speed() - second_speed(); }
  double energy() const { return plant_.gear_train().energy(plant_.state().data()); }
  double momentum() const { return kFirst * first_speed() + kSecond * second_speed(); }
  double force() const {  // on the second body [N]
    double rate[4];
    plant_.gear_train().derivative(0, plant_.state().data(), 0, rate);
    return kSecond * kRadius * rate[3];
  }
  /// Moves on by `step` [s] until the bodies have met and parted.
  void finish(double step) {
    for (int k = 1; k < 2000 && !(rate() < 0 && penetration() < 0); ++k) plant_.advance_to(touch_ + k * step);
    ASSERT_LT(penetration(), 0) << "they have not parted";
  }

 private:
  Plant plant_;
  double touch_;  // s
};

/// Time in which the undamped impact K d^n would come to its deepest point, about.
double impact_time(double exponent, double speed) {
  return std::pow(0.5 * (exponent + 1) * kReduced * speed * speed / kStiffness, 1 / (exponent + 1)) / speed;
}

double simulated_restitution(const Law& law, double exponent, double speed) {
  Meeting impact(law, speed);
  impact.finish(impact_time(exponent, speed));
  EXPECT_NEAR(impact.momentum(), kFirst * speed, 1e-12 * speed);  // equal and opposite forces, rounding
  return -impact.rate() / speed;
}

/// A law, and the restitution that theory gives it.
struct Case {
  std::string name;
  double exponent;
  Law law;
  std::function<double(double speed)> restitution;
};

Law falling(const std::string& name, double n) {
  return model::make_contact_law(
      name,
      {{"stiffness", kStiffness}, {"exponent", n}, {"alpha", 0.4}, {"beta", 0.25}, {"minimum_speed", 1e-3}});
}

double wanted(double speed) {  // of both falling laws
  return 1 - 0.4 * std::pow(speed, 0.25);
}

void add_linear_cases(std::vector<Case>& cases) {
  for (double z : {0.05, 0.3}) {  // of critical damping
    const double c = 2 * z * std::sqrt(kStiffness * kReduced), w = std::sqrt(1 - z * z);
    cases.push_back({"kelvin_voigt", 1,
                     model::make_contact_law("kelvin_voigt", {{"stiffness", kStiffness}, {"damping", c}}),
                     [=](double) { return std::exp(-M_PI * z / w); }});
    // Schwager and Poeschel (2007): the contact ends where its force would turn into tension
    cases.push_back(
        {"linear", 1, model::make_contact_law("linear", {{"stiffness", kStiffness}, {"damping", c}}),
         [=](double) { return std::exp(-z / w * (M_PI - std::atan2(2 * z * w, w * w - z * z))); }});
  }
}

Law foundation(double exponent, double damping) {
  return model::make_contact_law("foundation", {{"stiffness", kStiffness},
                                                {"exponent", exponent},
                                                {"radius", 0.5 / M_PI},  // 2 pi R = 1 m
                                                {"viscosity", damping},
                                                {"thickness", 0.5},
                                                {"share", 0.5}});
}

void add_foundation_cases(std::vector<Case>& cases) {
  // n = 1 is separable: the exact relation with D = lambda v / K
  cases.push_back({"foundation", 1, foundation(1, 6e7),
                   [](double v) { return model::restitution_of_damping(6e7 * v / kStiffness); }});
  // n = 1.5: energy balance with the undamped speed v sqrt(1 - (d/d_max)^2.5), loss 2 lambda times the
  // integral of d times it over d: 2 lambda v d_max^2 B(4/5, 3/2) / 2.5. Its square, left out, is up to 2e-8.
  const double lambda = 150, beta = std::tgamma(0.8) * std::tgamma(1.5) / std::tgamma(2.3);
  cases.push_back({"foundation", 1.5, foundation(1.5, lambda), [=](double v) {
                     const double deepest = std::pow(1.25 * kReduced * v * v / kStiffness, 0.4);
                     const double loss = 0.8 * lambda * v * deepest * deepest * beta;
                     return std::sqrt(1 - loss / (0.5 * kReduced * v * v));
                   }});
}

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  add_linear_cases(cases);
  add_foundation_cases(cases);
  for (double n : {1.0, 1.5}) {
    cases.push_back({"power_law", n,
                     model::make_contact_law("power_law", {{"stiffness", kStiffness}, {"exponent", n}}),
                     [](double) { return 1.0; }});
    cases.push_back({"hunt_crossley", n,
                     model::make_contact_law("hunt_crossley",
                                             {{"stiffness", kStiffness}, {"exponent", n}, {"alpha", 0.7}}),
                     [](double v) { return model::restitution_of_damping(1.5 * 0.7 * v); }});
    cases.push_back({"herbert_mcwhannell", n, falling("herbert_mcwhannell", n), wanted});
    cases.push_back({"yang_sun", n, falling("yang_sun", n), [](double v) {
                       const double e = wanted(v);
                       return model::restitution_of_damping(6 * (1 - e) / ((2 * e - 1) * (2 * e - 1) + 3));
                     }});
    cases.push_back(
        {"lankarani_nikravesh", n,
         model::make_contact_law(
             "lankarani_nikravesh",
             {{"stiffness", kStiffness}, {"exponent", n}, {"restitution", 0.5}, {"minimum_speed", 1e-3}}),
         [](double) { return model::restitution_of_damping(0.75 * 0.75); }});
  }
  cases.push_back({"hertz_in_series", 1.5,
                   model::make_contact_law(
                       "hertz_in_series",
                       {{"stiffness", kStiffness}, {"series_stiffness", 0.1 * kStiffness}, {"damping", 0}}),
                   [](double) { return 1.0; }});
  for (double e : {0.9, 0.5})
    cases.push_back(
        {"jankowski", 1.5,
         model::make_contact_law(
             "jankowski", {{"stiffness", kStiffness}, {"restitution", e}, {"effective_mass", kReduced}}),
         [=](double) { return model::jankowski_restitution(model::jankowski_damping_ratio(e)); }});
  cases.push_back(
      {"stereomechanical", 1,
       model::make_contact_law(
           "stereomechanical",
           {{"restitution", 0.6}, {"resting_speed", 1e-3}, {"stiffness", kStiffness}, {"damping", 100}}),
       [](double) { return 0.6; }});
  return cases;
}

TEST(TwoBodyImpact, TheTestCoversTheRegistry) {
  for (const model::ContactLawType& type : model::contact_laws()) {
    bool covered = false;
    for (const Case& c : all_cases()) covered |= c.name == type.name;
    EXPECT_TRUE(covered) << type.name;
  }
}

TEST(TwoBodyImpact, RestitutionIsThatOfTheLaw) {
  for (const Case& c : all_cases())
    for (double speed : kSpeeds)
      // 1e-10 tolerance per step over some hundred steps
      EXPECT_NEAR(simulated_restitution(c.law, c.exponent, speed), c.restitution(speed), 1e-7)
          << c.name << ", n = " << c.exponent << ", v = " << speed;
}

TEST(TwoBodyImpact, SlowTouchesAreDampedAsAtTheSmallestSpeed) {
  const double smallest = 0.05;
  for (double speed : {0.01, 0.03, 0.0499}) {
    const auto law = model::make_contact_law(
        "lankarani_nikravesh",
        {{"stiffness", kStiffness}, {"exponent", 1.5}, {"restitution", 0.5}, {"minimum_speed", smallest}});
    EXPECT_NEAR(simulated_restitution(law, 1.5, speed),
                model::restitution_of_damping(0.75 * 0.75 * speed / smallest), 1e-7);
  }
}

// What the loop encloses, from force and motion alone, against the kinetic energy that is gone.
TEST(TwoBodyImpact, LostEnergyIsTheAreaOfTheLoop) {
  const double speed = 0.3, touch = kHalfGap / speed;
  for (const Case& c : all_cases()) {
    if (c.name == "stereomechanical") continue;  // has no loop
    const double step = impact_time(c.exponent, speed) / 500;
    Meeting impact(c.law, speed);
    impact.advance_to(touch * (1 + 1e-9));  // inside
    const double before = 0.5 * kFirst * speed * speed;
    double area = 0, last = impact.force() * impact.rate();
    for (int k = 1; impact.penetration() > 0 && k < 10000; ++k) {
      impact.advance_to(touch * (1 + 1e-9) + k * step);
      const double power = impact.force() * impact.rate();
      area += 0.5 * (last + power) * step;
      last = power;
    }
    // trapezoids of about 1/1000 of the loop: 1e-5; more where the force jumps as they part (half a step of
    // tension), or begins as d^(1/4)
    const double tolerance = c.name == "kelvin_voigt" ? 2e-3 : c.name == "jankowski" ? 5e-4 : 2e-5;
    EXPECT_NEAR(area, before - impact.energy(), tolerance * before) << c.name << ", n = " << c.exponent;
    const double e = c.restitution(speed);
    EXPECT_NEAR(before - impact.energy(), 0.5 * kReduced * speed * speed * (1 - e * e), 1e-6 * before)
        << c.name;
  }
}

TEST(TwoBodyImpact, OnlyKelvinVoigtPulls) {
  const double speed = 0.3, touch = kHalfGap / speed;
  for (const Case& c : all_cases()) {
    Meeting impact(c.law, speed, 1e-7);
    double least = 0;
    for (int k = 0; k < 400 && !(impact.rate() < 0 && impact.penetration() < 0); ++k) {
      impact.advance_to(touch + k * impact_time(c.exponent, speed) / 50);
      least = std::min(least, impact.force());
    }
    if (c.name == "kelvin_voigt") {
      EXPECT_LT(least, -20) << "the tension of the last moment";
    } else {
      EXPECT_GE(least, 0) << c.name;
    }
  }
}

TEST(TwoBodyImpact, KelvinVoigtBeginsWithAJump) {
  const double damping = 1000, speed = 0.3;
  Meeting impact(model::make_contact_law("kelvin_voigt", {{"stiffness", kStiffness}, {"damping", damping}}),
                 speed);
  impact.advance_to(kHalfGap / speed * (1 - 1e-9));
  EXPECT_EQ(impact.force(), 0);
  impact.advance_to(kHalfGap / speed * (1 + 1e-9));
  EXPECT_NEAR(impact.force(), damping * speed, 1e-3 * damping * speed);  // c v, Eq. 2.14; K d is 1e-4 of it
}

// Yumrukcal (2013), Eqs. 2.8 to 2.11 as corrected: both bodies while they touch, x from the touch on, the
// second at rest before it.
TEST(TwoBodyImpact, KelvinVoigtIsTheTwoMassOscillator) {
  const double damping = 1500, speed = 0.3, sum = kFirst + kSecond;
  const double w0 = std::sqrt(kStiffness / kReduced), z = damping / (2 * kReduced * w0);
  const double wd = w0 * std::sqrt(1 - z * z), mean = kFirst * speed / sum;  // g12; g11 and g22 are 0
  const double g21 = kReduced / (kFirst * wd) * speed;
  const double step = M_PI / wd / 20, touch = kHalfGap / speed;  // they part after 20 steps
  Meeting impact(model::make_contact_law("kelvin_voigt", {{"stiffness", kStiffness}, {"damping", damping}}),
                 speed);
  for (int k = 1; k < 20; ++k) {
    const double t = k * step, decay = std::exp(-z * w0 * t);
    impact.advance_to(touch + t);
    const double swing = decay * std::sin(wd * t),
                 rate = decay * (wd * std::cos(wd * t) - z * w0 * std::sin(wd * t));
    // 1e-10 tolerance per step over some hundred steps, of the largest values
    EXPECT_NEAR(impact.first_position() - kHalfGap, mean * t + g21 * swing, 1e-7 * g21) << k;
    EXPECT_NEAR(impact.penetration(), (1 + kFirst / kSecond) * g21 * swing, 1e-7 * g21) << k;  // x1 - x2
    EXPECT_NEAR(impact.first_speed(), mean + g21 * rate, 1e-7 * speed) << k;
    EXPECT_NEAR(impact.second_speed(), mean - kFirst / kSecond * g21 * rate, 1e-7 * speed) << k;
    EXPECT_NEAR(impact.rate(), speed / wd * rate, 1e-7 * speed) << k;  // Eq. 2.12
  }
}

// Yumrukcal (2013), Section 2.2.2.2: with the cube of the largest deformation in the foundation model, with
// its square in linear ones. It holds for the linear spring, whose contact takes the same time at all speeds.
TEST(TwoBodyImpact, LossGrowsWithThePowerOfTheDeepestPenetration) {
  struct Growth {
    Law law;
    double power;
  };
  for (const Growth& g :
       {Growth{foundation(1, 1e6), 3},
        {model::make_contact_law("kelvin_voigt", {{"stiffness", kStiffness}, {"damping", 20}}), 2}}) {
    std::vector<double> loss, deepest;
    for (const double speed : {0.02, 0.2}) {
      Meeting impact(g.law, speed);
      const double step = impact_time(1, speed) / 200;
      double most = 0;
      for (int k = 1; k < 1000 && !(impact.rate() < 0 && impact.penetration() < 0); ++k) {
        impact.advance_to(kHalfGap / speed + k * step);
        most = std::max(most, impact.penetration());
      }
      deepest.push_back(most);
      loss.push_back(0.5 * kFirst * speed * speed - impact.energy());
    }
    // Next order in a loss of some 1e-3; 1/200 of a step at the deepest place is 1e-5 of the penetration.
    EXPECT_NEAR(std::log(loss[1] / loss[0]) / std::log(deepest[1] / deepest[0]), g.power, 5e-3);
  }
}

TEST(TwoBodyImpact, StereomechanicalSpeedsAreThoseOfTheTheory) {
  for (double e : {0.0, 0.35, 1.0}) {
    const auto law = model::make_contact_law(
        "stereomechanical",
        {{"restitution", e}, {"resting_speed", 1e-3}, {"stiffness", kStiffness}, {"damping", 0}});
    Meeting impact(law, 0.3);
    impact.advance_to(1.1 * kHalfGap / 0.3);
    // Yumrukcal (2013), Eqs. 2.15 and 2.16, the second body at rest
    EXPECT_NEAR(impact.first_speed(), 0.3 - (1 + e) * kSecond * 0.3 / (kFirst + kSecond),
                1e-13);  // roundings of some steps
    EXPECT_NEAR(impact.second_speed(), (1 + e) * kFirst * 0.3 / (kFirst + kSecond),
                1e-13);                                             // roundings of some steps
    EXPECT_NEAR(impact.penetration(), -e * 0.1 * kHalfGap, 1e-12);  // so the jump took place where they touch
  }
}

}  // namespace
}  // namespace backlash::simulation
