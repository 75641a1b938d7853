// SPDX-License-Identifier: BSD-3-Clause
// Mesh stiffness that varies with position, seen in the motion of whole rigs.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <utility>
#include <vector>

#include "backlash_diagnosis/simulation/plant.h"
#include "support/gears.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

using test::constant;

constexpr double kStiffness = 1e7;  // N/m, mean

model::GearPair gears() {
  model::GearPair pair = test::gear_pair(20, 40, 1e-3);
  pair.centre_distance_change = 50e-6;
  return pair;
}

model::Rig rig_with(const std::shared_ptr<const model::StiffnessVariation>& variation) {
  model::Rig rig;
  rig.mesh.base_radius = model::gear_geometry(gears()).gear.base_radius;
  rig.mesh.backlash = model::gear_geometry(gears()).backlash;
  rig.mesh.contact = model::make_contact_law("linear", {{"stiffness", kStiffness}, {"damping", 1000}});
  rig.mesh.variation = variation;
  rig.motor.inertia = 1e-4;
  return rig;
}

model::MeshStiffness mesh_of(const std::string& law, double transition) {
  return model::MeshStiffness(gears(), {law, 0.01, 206e9, 0.3, transition});
}

// A gear that is held: the motor leans on it and sinks in by F / k at the phase that the offset sets.
TEST(MeshCycle, StaticDeflectionFollowsTheStiffness) {
  const double torque = 2;
  for (const std::string& law : model::mesh_stiffness_laws()) {
    const model::MeshStiffness mesh = mesh_of(law, 0.02);
    double least = 1e9, most = 0;
    for (const double offset : {0.05, 0.3, 0.45, 0.8, 0.95}) {
      model::Rig rig = rig_with(std::make_shared<model::StiffnessVariation>(mesh, offset));
      rig.link_locked = true;
      const double r = rig.mesh.base_radius;
      Plant plant(rig, constant(torque), test::solver(1e-9));
      // The contact rings at some 5000 rad/s and loses about a quarter per radian.
      plant.advance_to(0.02);
      const double travel = r * plant.observe().motor_position;
      const double deflection = travel - 0.5 * rig.mesh.backlash;
      const double phase = travel / mesh.geometry().base_pitch + offset;
      const double expected = torque / r / (kStiffness * mesh.stiffness(phase) / mesh.mean());
      EXPECT_NEAR(deflection, expected, 1e-6 * expected) << law << " " << offset;  // what still rings
      least = std::min(least, deflection);
      most = std::max(most, deflection);
    }
    EXPECT_GT(most / least, 1.5) << law;  // one pair against two
  }
}

struct Lines {
  double at_mesh, between;  // m, amplitude at the mesh frequency and 1.37 times that
};

// A loaded rig turning at a constant mean speed, as an observer sees the mesh: relative displacement along
// the line of action over a whole number of mesh cycles, in the angle that drives it.
Lines turning(const std::shared_ptr<const model::StiffnessVariation>& variation) {
  model::Rig rig = rig_with(variation);
  const double torque = 2, speed = 10;  // N m, rad/s of the gear
  rig.link.inertia = 0.01;
  rig.link.viscous_damping = torque / speed;
  Plant plant(rig, constant(torque), test::solver(1e-8));
  const double r = rig.mesh.base_radius, offset = 0.5 * rig.mesh.backlash + torque / r / kStiffness;
  plant.set_state({offset / r, 0, speed, speed});
  const double mesh_frequency = 40 * speed / (2 * M_PI);  // teeth of the gear times its turns per second
  std::complex<double> at_mesh = 0, between = 0;
  constexpr int kCycles = 60, kPerCycle = 200, kSettling = 20;
  for (int i = 0; i < (kCycles + kSettling) * kPerCycle; ++i) {
    plant.advance_to(i / (kPerCycle * mesh_frequency));
    if (i < kSettling * kPerCycle) continue;
    const model::Observation o = plant.observe();
    const double x = r * (o.motor_position - o.load_position) - offset, angle = 2 * M_PI * i / kPerCycle;
    const double window = 1 - std::cos(2 * M_PI * (i - kSettling * kPerCycle) / (kCycles * kPerCycle));
    at_mesh += window * x * std::polar(1.0, -angle);
    between += window * x * std::polar(1.0, -1.37 * angle);
  }
  return {2 * std::abs(at_mesh) / (kCycles * kPerCycle), 2 * std::abs(between) / (kCycles * kPerCycle)};
}

TEST(MeshCycle, ATurningLoadedRigHasALineAtTheMeshFrequency) {
  const double steady = turning(nullptr).at_mesh;
  for (const auto& [law, transition] : {std::pair{"hertz_bending", 0.05}, {"step", 0.0}}) {
    const model::MeshStiffness mesh = mesh_of(law, transition);
    const Lines varying = turning(std::make_shared<model::StiffnessVariation>(mesh, 0.2));
    // Far below the contact resonance (64 Hz against some 900 Hz) the deflection is quasi-static, F mean(k) /
    // (k K): its first harmonic by the cycle alone.
    const double force = 2 / model::gear_geometry(gears()).gear.base_radius;
    std::complex<double> line = 0;
    constexpr int kPoints = 10000;
    for (int i = 0; i < kPoints; ++i) {
      const double phase = (i + 0.5) / kPoints;
      line += force * mesh.mean() / (kStiffness * mesh.stiffness(phase)) *
              std::polar(2.0 / kPoints, -2 * M_PI * phase);
    }
    // The inertia still at work is (64 / 900)^2 = 0.5 %, the varying depth of contact below it.
    EXPECT_NEAR(varying.at_mesh, std::abs(line), 0.02 * std::abs(line)) << law;
    EXPECT_LT(varying.between, 1e-3 * varying.at_mesh) << law;
    EXPECT_LT(steady, 1e-3 * varying.at_mesh) << law;
  }
}

}  // namespace
}  // namespace backlash::simulation
