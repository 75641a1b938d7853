// SPDX-License-Identifier: BSD-3-Clause
// Mesh stiffness that varies with position, seen in the motion of whole rigs.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <string>
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

/// What a shipped rig of one's gears does once it turns steadily: seen by its motion alone.
struct Turning {
  double cycles = 0;               // mesh cycles
  double least = 0, mean = 0;      // N m, torque through the teeth
  double losses = 0;               // of contact, at most one per half a cycle
  double share_lost = 0;           // of the time
  double line = 0, between = 0;    // N m, of the torque sensor: at teeth times speed and 1.37 times that
  double drive = 0, friction = 0;  // W, mean
  double into_mesh = 0;            // W, mean, what the teeth take
};

/// Of the drive: a stiffness that changes under load does work of its own (model/stiffness_variation.h).
/// Simulation: it gives 0.10 % at a contact ratio of 1.65 and 0.21 % at 0.98; twice that allowed.
constexpr double kParametric = 0.004;

/// The torque through the teeth from the motion of the gear: J a + c w, without any contact law.
Turning turn(const std::string& name) {
  constexpr double kFrom = 0.1, kFor = 1;  // s; it settles in 4 ms
  constexpr int kPerSecond = 50000;
  const model::Rig rig =
      model::read_rig(YamlReader::from_file(test::package_file("config/" + name + ".yaml")));
  const double inertia = rig.gear.inertia + rig.link.inertia, drag = rig.link.viscous_damping;
  const double torque = 0.2, free = 1e-4 * torque;  // N m: of the solver's tolerance, not of any force
  Plant plant(rig, constant(torque), test::solver(1e-8));
  Turning t;
  std::complex<double> line = 0, between = 0;
  double start = 0, weight = 0;
  double last = -1e9;
  for (int i = 0; i <= kFor * kPerSecond; ++i) {
    plant.advance_to(kFrom + double(i) / kPerSecond);
    const model::Observation o = plant.observe();
    if (i == 0) start = o.load_position;
    const double through = inertia * o.acceleration + drag * o.load_velocity;
    const bool lost = std::abs(through) < free;
    // Teeth that come back bounce: a loss counts once per half a cycle.
    if (lost && 40 * (o.load_position - last) > M_PI) {
      ++t.losses;
      last = o.load_position;
    }
    t.share_lost += lost;
    t.least = i == 0 ? through : std::min(t.least, through);
    t.mean += through;
    t.drive += torque * o.motor_velocity;
    t.friction += rig.motor.viscous_damping * std::pow(o.motor_velocity, 2) +
                  rig.input_coupling.damping * std::pow(o.sensor_twist_rate, 2) +
                  drag * std::pow(o.load_velocity, 2);
    const double pinion = o.motor_velocity - o.sensor_twist_rate;
    t.into_mesh += through * (pinion - o.load_velocity);
    const double window = 1 - std::cos(2 * M_PI * i / (kFor * kPerSecond)), tooth = 40 * o.load_position;
    weight += window;
    line += 2 * window * o.sensor_torque * std::polar(1.0, -tooth);
    between += 2 * window * o.sensor_torque * std::polar(1.0, -1.37 * tooth);
    t.cycles = 40 * (o.load_position - start) / (2 * M_PI);
  }
  const double n = kFor * kPerSecond + 1;
  for (double* mean : {&t.share_lost, &t.mean, &t.drive, &t.friction, &t.into_mesh}) *mean /= n;
  t.line = std::abs(line) / weight;
  t.between = std::abs(between) / weight;
  return t;
}

// 40 teeth, 10 rad/s: 0.2 N m over the drags of motor and link, 0.0048 + 0.0152 N m s/rad.
TEST(MeshCycle, TheShippedGearsTurnThroughTheirTeeth) {
  const Turning t = turn("sarkar_1997_turning");
  EXPECT_NEAR(t.cycles, 400 / (2 * M_PI), 0.5);
  EXPECT_NEAR(t.mean, 0.152, 0.001);
  EXPECT_EQ(t.losses, 0);
  EXPECT_GT(t.least, 0);
  EXPECT_GT(t.line, 20 * t.between) << t.line;
  // What is driven in is rubbed away and what the teeth take, but for what moves slowly: 1e-3 of it.
  EXPECT_NEAR(t.drive, t.friction + t.into_mesh, 1e-3 * t.drive);
  EXPECT_LT(std::abs(t.into_mesh), kParametric * t.drive);
}

TEST(MeshCycle, BelowAContactRatioOfOneContactIsLostOncePerToothWithoutReversal) {
  const Turning t = turn("sarkar_1997_interrupted");
  EXPECT_NEAR(t.losses, t.cycles, 1);
  // Contact ratio 0.978 (standard involute theory): 1 - 0.978 of each cycle, less the transition of 0.005 and
  // one sample of 785. More where the teeth bounce.
  EXPECT_GT(t.share_lost, 0.022 - 0.005 - 1.0 / 785);
  EXPECT_LT(t.share_lost, 0.1);
  EXPECT_NEAR(t.mean, 0.152, 0.002);
  EXPECT_GT(t.line, 20 * t.between) << t.line;
  EXPECT_NEAR(t.drive, t.friction + t.into_mesh, 1e-3 * t.drive);
  EXPECT_LT(std::abs(t.into_mesh), kParametric * t.drive);
}

}  // namespace
}  // namespace backlash::simulation
