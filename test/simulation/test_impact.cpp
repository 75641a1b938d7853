// SPDX-License-Identifier: BSD-3-Clause
// Single impacts against a wall, each with a closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

constexpr double kMass = 0.125, kHalfGap = 1e-3;
const double kRadius = 0.02;  // of wall_rig()

/// One mass without any torque, which touches the forward wall at time 0.
class Bounce {
 public:
  Bounce(std::shared_ptr<const model::ContactLaw> law, double speed,
         const SolverSettings& solver = test::solver(1e-10))
      : plant_(test::wall_rig(kMass, kHalfGap, std::move(law)), test::constant(0), solver) {
    Plant::State state{};
    state[0] = kHalfGap / kRadius;
    state[1] = speed / kRadius;
    plant_.set_state(state);
  }
  void advance_to(double t) { plant_.advance_to(t); }
  double penetration() const { return kRadius * plant_.state()[0] - kHalfGap; }
  double speed() const { return kRadius * plant_.state()[1]; }
  double push() const {  // force of the wall, > 0 pushes back [N]
    double rate[2];
    plant_.gear_train().derivative(0, plant_.state().data(), 0, rate);
    return -kMass * kRadius * rate[1];
  }

 private:
  Plant plant_;
};

std::shared_ptr<const model::ContactLaw> linear(double stiffness, double damping) {
  return model::make_contact_law("linear", {{"stiffness", stiffness}, {"damping", damping}});
}

TEST(Impact, UndampedLinearContactIsAHalfSine) {
  const double stiffness = 1e7, omega = std::sqrt(stiffness / kMass);
  for (double speed : {0.001, 0.05, 1.0}) {
    const double deepest = speed / omega;
    Bounce bounce(linear(stiffness, 0), speed);
    for (int k = 1; k < 50; ++k) {
      const double t = k * M_PI / omega / 50;
      bounce.advance_to(t);
      // 1e-10 tolerance per step over some 500 steps
      EXPECT_NEAR(bounce.penetration(), deepest * std::sin(omega * t), 1e-7 * deepest);
      EXPECT_NEAR(bounce.speed(), speed * std::cos(omega * t), 1e-7 * speed);
      if (k == 25) {
        EXPECT_NEAR(bounce.penetration(), speed * std::sqrt(kMass / stiffness), 1e-7 * deepest);
      }
    }
    const double later = 1.5 * M_PI / omega;
    bounce.advance_to(later);
    EXPECT_NEAR(bounce.speed(), -speed, 1e-7 * speed);  // restitution 1
    const double contact_time = later - bounce.penetration() / bounce.speed();
    EXPECT_NEAR(contact_time, M_PI * std::sqrt(kMass / stiffness), 1e-7 * contact_time);
  }
}

TEST(Impact, UndampedMassTravelsBetweenTheWallsForEver) {
  const double stiffness = 1e7, speed = 0.5;
  const double period = 4 * kHalfGap / speed + 2 * M_PI * std::sqrt(kMass / stiffness);
  Bounce bounce(linear(stiffness, 0), speed);
  for (int turn = 1; turn <= 20; ++turn) {
    bounce.advance_to(turn * period);
    EXPECT_NEAR(bounce.penetration(), 0, 1e-6 * kHalfGap) << turn;  // 40 impacts at the tolerance above
    EXPECT_NEAR(bounce.speed(), speed, 1e-6 * speed) << turn;
  }
  bounce.advance_to(20.5 * period);
  EXPECT_NEAR(bounce.penetration(), -2 * kHalfGap, 1e-6 * kHalfGap);  // touches the other wall
  EXPECT_NEAR(bounce.speed(), -speed, 1e-6 * speed);
}

TEST(Impact, WithoutBacklashBothFlanksTogetherAreOneSpring) {
  const double stiffness = 1e7, speed = 0.05, omega = std::sqrt(stiffness / kMass);
  Plant plant(test::wall_rig(kMass, 0, linear(stiffness, 0)), test::constant(0), test::solver(1e-10));
  Plant::State state{};
  state[1] = speed / kRadius;
  plant.set_state(state);
  for (int k = 1; k < 200; ++k) {  // some five full turns through both flanks
    const double t = k * 0.16 / omega;
    plant.advance_to(t);
    EXPECT_NEAR(kRadius * plant.state()[0], speed / omega * std::sin(omega * t), 1e-6 * speed / omega);
  }
}

// Kelvin-Voigt contact that ends where its force would turn into tension: Schwager and Poeschel (2007),
// "Coefficient of restitution and linear-dashpot model revisited", e = exp(-b/w (pi - atan(2 b w / (w^2 -
// b^2)))), b = c / 2m < w.
TEST(Impact, KelvinVoigtRestitutionHasItsClosedForm) {
  const double stiffness = 1e7;
  for (double ratio : {0.02, 0.1, 0.3, 0.6}) {  // of critical damping
    const double b = ratio * std::sqrt(stiffness / kMass), w = std::sqrt(stiffness / kMass - b * b);
    const double end = (M_PI - std::atan2(2 * b * w, w * w - b * b)) / w;
    const double restitution = std::exp(-b * end), speed = 0.1;
    Bounce bounce(linear(stiffness, 2 * b * kMass), speed);
    bounce.advance_to(0.999 * end);
    EXPECT_GT(bounce.push(), 0);
    EXPECT_NEAR(bounce.penetration(), speed / w * std::exp(-b * 0.999 * end) * std::sin(w * 0.999 * end),
                1e-7 * speed / w);
    bounce.advance_to(1.001 * end);
    EXPECT_EQ(bounce.push(), 0);  // not yet apart, but no tension
    EXPECT_GT(bounce.penetration(), 0);
    bounce.advance_to(5 * end);
    EXPECT_NEAR(-bounce.speed() / speed, restitution, 1e-7) << "damping ratio " << ratio;
  }
}

/// Solves D (1+e) = ln((1+D)/(1-e D)) for e by bisection.
double exact_restitution(double d) {
  double low = 0, high = std::min(1.0, 1 / d);
  for (int i = 0; i < 200; ++i) {
    const double e = 0.5 * (low + high);
    (d * (1 + e) > std::log((1 + d) / (1 - e * d)) ? low : high) = e;
  }
  return 0.5 * (low + high);
}

TEST(Impact, HuntCrossleyRestitutionFollowsTheExactRelation) {
  EXPECT_NEAR(exact_restitution(0.3731), 0.8,
              1e-4);  // REFERENCE: D = 0.1665, 0.3731, 1.4328 for e = 0.9, 0.8, 0.5
  EXPECT_NEAR(exact_restitution(1.4328), 0.5, 1e-4);
  const double stiffness = 1e8;
  for (double exponent : {1.0, 1.25, 1.5})
    for (double alpha : {0.1, 0.72})
      for (double speed : {0.01, 0.03, 0.1, 0.3, 1.0}) {
        const auto law = model::make_contact_law(
            "hunt_crossley", {{"stiffness", stiffness}, {"exponent", exponent}, {"alpha", alpha}});
        Bounce bounce(law, speed);
        const double deepest =  // of the undamped impact, from m v^2 / 2 = K d^(n+1) / (n+1)
            std::pow(0.5 * (exponent + 1) * kMass * speed * speed / stiffness, 1 / (exponent + 1));
        bounce.advance_to(6 * deepest / speed);  // contact lasts about half of that
        ASSERT_LT(bounce.penetration(), 0);
        // independent of mass, stiffness and exponent; 1e-10 tolerance per step over some hundred steps
        EXPECT_NEAR(-bounce.speed() / speed, exact_restitution(1.5 * alpha * speed), 1e-7)
            << "n = " << exponent << ", alpha = " << alpha << ", v = " << speed;
      }
}

TEST(Impact, RestitutionAtSmallSpeedIsOneMinusAlphaTimesSpeed) {
  const auto law =
      model::make_contact_law("hunt_crossley", {{"stiffness", 1e8}, {"exponent", 1.5}, {"alpha", 0.5}});
  Bounce bounce(law, 0.01);
  bounce.advance_to(0.05);
  // Hunt and Crossley (1975); the next term is of the order (alpha v)^2 = 2.5e-5
  EXPECT_NEAR(-bounce.speed() / 0.01, 1 - 0.5 * 0.01, 5e-5);
}

TEST(Impact, TheWallNeverPulls) {
  const std::shared_ptr<const model::ContactLaw> laws[] = {
      linear(1e7, 0), linear(1e7, 500),
      model::make_contact_law("power_law", {{"stiffness", 1e8}, {"exponent", 1.5}}),
      model::make_contact_law("hunt_crossley", {{"stiffness", 1e8}, {"exponent", 1.5}, {"alpha", 2}})};
  for (const auto& law : laws)
    for (const std::string& method : integrator_methods()) {
      Bounce bounce(law, 1, test::solver(1e-6, method));
      double most = 0;
      for (int k = 1; k <= 500; ++k) {
        bounce.advance_to(k * 3e-6);
        EXPECT_GE(bounce.push(), 0) << method;
        if (bounce.penetration() < 0) {
          EXPECT_EQ(bounce.push(), 0) << method;
        }
        most = std::max(most, bounce.push());
      }
      EXPECT_GT(most, 100) << method << ": there was an impact";
      EXPECT_LT(bounce.penetration(), 0) << method << ": and it ended";
      EXPECT_LE(-bounce.speed(), 1 + 1e-4) << method << ": no faster than it came";  // hundred tolerances
    }
}

}  // namespace
}  // namespace backlash::simulation
