// SPDX-License-Identifier: BSD-3-Clause
// Pairs of teeth that come and go, seen in the motion of whole rigs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <vector>

#include "backlash_diagnosis/simulation/plant.h"
#include "support/gears.h"
#include "support/rigs.h"
#include "support/tooth_pairs.h"

namespace backlash::simulation {
namespace {

using test::constant;

constexpr int kPinion = 20, kGear = 40;             // teeth
constexpr double kStiffness = 1e7, kDamping = 1e3;  // N/m, N s/m, means over the mesh cycle
constexpr double kTransition = 0.1;                 // base pitches
constexpr double kTorque = 2, kSpeed = 1;           // N m and rad/s of the gear

model::GearPair gears() {
  model::GearPair pair = test::gear_pair(kPinion, kGear, 1e-3);
  pair.centre_distance_change = 50e-6;
  return pair;
}

model::ToothErrors errors(double slope, double runout) {
  model::ToothErrors e;
  e.slope = slope, e.crown = 0.5 * slope;
  e.pinion.runout = runout, e.pinion.phase = 0.6;
  return e;
}

model::Rig rig_with(const model::ToothErrors& errors, double damping) {
  model::Rig rig;
  rig.mesh.base_radius = model::gear_geometry(gears()).gear.base_radius;
  rig.mesh.backlash = 50e-6;
  rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", kStiffness}, {"damping", damping}});
  rig.mesh.pairs = std::make_shared<model::ToothPairs>(
      model::MeshCycle{model::MeshStiffness(gears(), {"lin_parker", 0.01, 206e9, 0.3, kTransition}), 0.0},
      errors);
  rig.motor.inertia = 1e-4;
  rig.link.inertia = 3e-4;
  return rig;
}

// Two gears that turn freely and knock from flank to flank, no damper anywhere: their energy stays while
// pairs come and go. The solver leaves 1e-8 of it.
TEST(ToothPairsInMotion, EnergyIsKept) {
  for (const double size : {0.0, 10e-6}) {
    const model::Rig rig = rig_with(errors(size, size), 0);
    Plant plant(rig, constant(0), test::solver(1e-10));
    plant.set_state({0, 0, 11, 10});
    const double all = 0.5 * (1e-4 * 11 * 11 + 3e-4 * 10 * 10), r = rig.mesh.base_radius;
    int on_flanks = 0;
    double most_elastic = 0;
    for (int i = 0; i < 4000; ++i) {
      plant.advance_to(i * 5e-5);  // 13 teeth
      const model::Observation o = plant.observe();
      const double state[] = {o.motor_position, o.load_position, o.motor_velocity, o.load_velocity};
      EXPECT_NEAR(plant.gear_train().energy(state), all, 1e-6 * all) << i;
      const double moving =
          0.5 * (1e-4 * std::pow(o.motor_velocity, 2) + 3e-4 * std::pow(o.load_velocity, 2));
      most_elastic = std::max(most_elastic, all - moving);
      on_flanks += std::fabs(r * (o.motor_position - o.load_position)) > 25e-6 + size;
    }
    EXPECT_GT(on_flanks, 100);
    // Without errors, in a knock all that the relative motion has, J (11 - 10)^2 / 2 with J = 7.5e-5, is in
    // the teeth.
    if (size == 0) EXPECT_NEAR(most_elastic, 0.5 * 7.5e-5, 0.05 * 0.5 * 7.5e-5);
  }
}

/// Amplitudes along the line of action [m] at the order of the teeth and of the pinion's turns.
struct Wave {
  std::complex<double> teeth, pinion;
};

/// Over whole turns of the pinion; `depth(phase)` in m.
template <typename Depth>
Wave wave_of(const Depth& depth, int turns) {
  constexpr int kPerTooth = 200;
  const int points = turns * kPinion * kPerTooth;
  Wave wave{};
  for (int i = 0; i < points; ++i) {
    const double phase = double(i) / kPerTooth, d = depth(phase);
    wave.teeth += 2.0 / points * d * std::polar(1.0, -2 * M_PI * phase);
    wave.pinion += 2.0 / points * d * std::polar(1.0, -2 * M_PI * phase / kPinion);
  }
  return wave;
}

// A rig that turns slowly against a constant torque (6.4 teeth per second, contact resonance 1100 Hz) shows
// the depth at rest: a transmission error of the order of the teeth from the flanks, of the pinion's turns
// from its runout.
TEST(ToothPairsInMotion, ErrorsOfTheTeethAreATransmissionError) {
  const double eps = model::gear_geometry(gears()).contact_ratio;
  const double pitch = model::gear_geometry(gears()).base_pitch;
  for (const auto& [slope, runout] : {std::pair{0.0, 0.0}, {20e-6, 0.0}, {0.0, 15e-6}, {20e-6, 15e-6}}) {
    const model::ToothErrors e = errors(slope, runout);
    model::Rig rig = rig_with(e, kDamping);
    rig.motor.inertia = 1e4;  // turns evenly, whatever it is spared
    const double r = rig.mesh.base_radius, force = kTorque / r;
    const auto at_rest = [&](double phase) {
      return test::depth_at_rest({eps, kTransition, kStiffness, kPinion, kGear}, e, phase, force);
    };
    const Wave expected = wave_of(at_rest, 1);
    ExcitationSettings brake = constant(-kTorque);
    brake.at_load = true;
    Plant plant(rig, brake, test::solver(1e-9));
    const double start = (25e-6 + at_rest(0)) / r;
    plant.set_state({0, -start, kSpeed, kSpeed});
    double time = 0;
    const auto moving = [&](double phase) {
      // Settle for the first tooth, then stop where the pinion is at this phase.
      for (double left = 1; std::fabs(left) > 1e-9;) {
        left = phase + 1 - r * plant.observe().motor_position / pitch;
        if (left < 1e-9) break;
        plant.advance_to(time += std::min(left * pitch / (r * plant.observe().motor_velocity), 1e-3));
      }
      const model::Observation o = plant.observe();
      return r * (o.motor_position - o.load_position) - 25e-6;
    };
    const Wave seen = wave_of([&](double phase) { return moving(phase); }, 1);
    // The simulation starts one tooth on.
    const auto turned = [](std::complex<double> z, double of_a_tooth) {
      return z * std::polar(1.0, 2 * M_PI * of_a_tooth);
    };
    // c omega / k = 0.4 % of what the teeth give way, and the solver's tolerance.
    const double allowed = 0.01 * (std::abs(expected.teeth) + runout);
    EXPECT_LT(std::abs(seen.teeth - expected.teeth), allowed) << slope << " " << runout;
    EXPECT_LT(std::abs(seen.pinion - turned(expected.pinion, 1.0 / kPinion)), allowed)
        << slope << " " << runout;
    if (runout > 0 && slope == 0) EXPECT_NEAR(std::abs(seen.pinion), runout, 0.02 * runout);
  }
}

}  // namespace
}  // namespace backlash::simulation
