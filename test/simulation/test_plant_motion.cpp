// SPDX-License-Identifier: BSD-3-Clause
// The whole gear train in motion against energy, statics, refinement and an integration of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/simulation/plant.h"
#include "support/rigs.h"

namespace backlash::simulation {
namespace {

constexpr double kTorque = 0.05;

model::Rig without_dampers(model::Rig rig) {
  for (model::Body* body : {&rig.motor, &rig.pinion, &rig.gear, &rig.link}) body->viscous_damping = 0;
  rig.input_coupling.damping = rig.output_coupling.damping = 0;
  rig.mesh.contact =
      model::make_contact_law("hunt_crossley", {{"stiffness", 2.28e8}, {"exponent", 1.5}, {"alpha", 0}});
  return rig;
}

model::Rig with_free_link(model::Rig rig) {
  rig.link_locked = false;
  rig.link.inertia = 3e-4;
  return rig;
}

double energy(const Plant& plant) {
  return plant.gear_train().energy(plant.state().data());
}

/// Largest change of energy minus work of the motor within `duration`, per largest energy.
double energy_drift(Plant& plant, double torque, double duration) {
  const double start_energy = energy(plant), start = plant.state()[0];
  double drift = 0, largest = start_energy;
  for (int k = 1; k <= 200; ++k) {
    plant.advance_to(k * duration / 200);
    const double work = torque * (plant.state()[0] - start);
    drift = std::max(drift, std::fabs(energy(plant) - start_energy - work));
    largest = std::max(largest, energy(plant));
  }
  return drift / largest;
}

TEST(PlantMotion, EnergyIsKeptWithoutDamping) {
  for (const std::string& method : integrator_methods())
    for (bool free_link : {false, true})
      for (double torque : {0.0, kTorque}) {
        const model::Rig locked = without_dampers(test::sarkar_rig(30e-6));
        Plant plant(free_link ? with_free_link(locked) : locked, test::constant(torque),
                    test::solver(1e-9, method));
        Plant::State state{};
        if (torque == 0) state[plant.gear_train().dof()] = 3;  // the motor turns, all else rests
        plant.set_state(state);
        const double drift = energy_drift(plant, torque, 0.05);
        // tolerances add up over some thousand steps in dozens of impacts; measured at most 1.1e-6
        EXPECT_LT(drift, 1e-5) << method << (free_link ? ", free link" : ", locked") << ", torque " << torque;
      }
}

TEST(PlantMotion, EnergyDriftFallsWithTheTolerance) {
  double last = 1;
  for (double tolerance : {1e-5, 1e-7, 1e-9, 1e-11}) {
    Plant plant(without_dampers(test::sarkar_rig(30e-6)), test::constant(kTorque), test::solver(tolerance));
    const double drift = energy_drift(plant, kTorque, 0.05);
    EXPECT_LT(drift, 0.3 * last) << tolerance;  // two decades; step control makes it scatter
    last = drift;
  }
}

/// Power lost in a Hunt-Crossley contact, from its equation: K d^n 3/2 alpha d'^2.
double hunt_crossley_loss(const model::Rig& rig, const Plant::State& s) {
  const double r = rig.mesh.base_radius, rate = r * (s[4] - s[5]);
  const double d = r * std::fabs(s[1] - s[2]) - 0.5 * rig.mesh.backlash;
  return d > 0 ? 2.28e8 * std::pow(d, 1.5) * 1.5 * 0.72 * rate * rate : 0;
}

/// Energy balance over 50 ms of the damped rig, per work of the motor; `loss` is the contact's own power
/// loss.
double damped_imbalance(const model::Rig& rig, const std::function<double(const Plant::State&)>& loss) {
  Plant plant(rig, test::constant(kTorque), test::solver(1e-9));
  const int count = 50000;
  const double dt = 0.05 / count;
  double lost = 0;
  for (int k = 0; k <= count; ++k) {
    plant.advance_to(k * dt);
    const double power = plant.gear_train().damping_power(plant.state().data()) + loss(plant.state());
    lost += power * dt * (k == 0 || k == count ? 1 : k % 2 ? 4 : 2) / 3;  // Simpson
  }
  const double work = kTorque * plant.state()[0];
  EXPECT_GT(lost, 0.05 * work);  // the dampers matter
  return (energy(plant) + lost - work) / work;
}

TEST(PlantMotion, EnergyLostIsThatOfTheDampers) {
  model::Rig rig = test::sarkar_rig(30e-6);
  rig.mesh.contact = model::make_contact_law("power_law", {{"stiffness", 2.28e8}, {"exponent", 1.5}});
  const double imbalance = damped_imbalance(rig, [](const Plant::State&) { return 0.0; });
  EXPECT_NEAR(imbalance, 0, 1e-6);  // 1e-9 tolerance, steps of 1 us; measured 2e-8
}

TEST(PlantMotion, EnergyLostIsThatOfDampersAndContact) {
  const model::Rig rig = test::sarkar_rig(30e-6);
  double contact = 0;
  const double imbalance = damped_imbalance(rig, [&](const Plant::State& s) {
    const double loss = hunt_crossley_loss(rig, s);
    contact += loss * 1e-6;
    return loss;
  });
  EXPECT_NEAR(imbalance, 0, 1e-6);
  EXPECT_GT(contact, 1e-5);  // J, of some 2e-4 J of work: a contact left out would show
}

TEST(PlantMotion, ComesToRestAtTheStaticDeflection) {
  for (double ratio : {1.0, 20.0})
    for (double torque : {-0.05, 0.05}) {
      model::Rig rig = test::sarkar_rig(30e-6);
      rig.motor_side = ratio > 1;
      rig.reduction_ratio = ratio;
      rig.input_coupling.damping = 0.05;  // settles faster
      Plant plant(rig, test::constant(torque), test::solver(1e-8));
      plant.advance_to(3);
      const model::GearTrain& train = plant.gear_train();
      const double gap = std::copysign(0.5 * rig.backlash_angle(rig.mesh.backlash), torque);
      const double expected = gap + train.elastic_deflection(torque);
      EXPECT_NEAR(plant.observe().motor_position, expected, 1e-6 * std::fabs(expected));
      EXPECT_NEAR(plant.observe().sensor_torque, torque, 1e-6 * std::fabs(torque));
      EXPECT_NEAR(plant.observe().output_torque, torque * ratio, 1e-6 * std::fabs(torque * ratio));
    }
}

// The equations of REFERENCE.md 1.4 for the rig of Sarkar, Ellis and Moore with a locked link, and the
// classical Runge-Kutta method with a fixed step: shares nothing with GearTrain and Integrator.
using Vector = std::array<double, 6>;  // theta_M, theta_1, theta_2 and their rates

Vector sarkar_rates(const Vector& y, double torque, double half_gap) {
  const double r = 0.014917, x = r * (y[1] - y[2]), v = r * (y[4] - y[5]);
  double contact = 0;
  if (x > half_gap) contact = 2.28e8 * std::pow(x - half_gap, 1.5) * std::max(0.0, 1 + 1.5 * 0.72 * v);
  if (-x > half_gap) contact = -2.28e8 * std::pow(-x - half_gap, 1.5) * std::max(0.0, 1 - 1.5 * 0.72 * v);
  const double input = 28.71 * (y[0] - y[1]) + 1.76e-4 * (y[3] - y[4]);
  const double output = 6310 * y[2] + 0.0513 * y[5];
  return {y[3],
          y[4],
          y[5],
          (torque - 0.0048 * y[3] - input) / 2.24e-5,
          (input - r * contact) / 2.1e-5,
          (r * contact - output) / 2.1e-5};
}

void runge_kutta_step(Vector& y, double h, double torque, double half_gap) {
  const auto moved = [&](const Vector& rate, double dt) {
    Vector z = y;
    for (std::size_t i = 0; i < z.size(); ++i) z[i] += dt * rate[i];
    return z;
  };
  const Vector k1 = sarkar_rates(y, torque, half_gap), k2 = sarkar_rates(moved(k1, h / 2), torque, half_gap);
  const Vector k3 = sarkar_rates(moved(k2, h / 2), torque, half_gap);
  const Vector k4 = sarkar_rates(moved(k3, h), torque, half_gap);
  for (std::size_t i = 0; i < y.size(); ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
}

TEST(PlantMotion, AgreesWithAnIndependentFixedStepRungeKuttaOverTwoPeriods) {
  const double half_gap = 30e-6, sample = 2e-4;
  const int steps = 2000;  // per sample: 0.1 us, some thousand in the shortest oscillation
  Plant plant(test::sarkar_rig(half_gap), test::square(kTorque, 10), test::solver(1e-11));
  Vector y{}, worst{}, largest{};
  for (int k = 0; k < 1000; ++k) {
    const double torque =
        k / 250 % 2 == 0 ? kTorque : -kTorque;  // switches at multiples of 0.05 s = 250 samples
    for (int i = 0; i < steps; ++i) runge_kutta_step(y, sample / steps, torque, half_gap);
    plant.advance_to((k + 1) * sample);
    for (std::size_t i = 0; i < y.size(); ++i) {
      worst[i] = std::max(worst[i], std::fabs(plant.state()[i] - y[i]));
      largest[i] = std::max(largest[i], std::fabs(y[i]));
    }
  }
  for (std::size_t i = 0; i < y.size(); ++i) {
    EXPECT_LT(worst[i], 1e-6 * largest[i]) << "state " << i;
  }
}

/// Sensor torque at 50 times within the first 5 ms: flight through the gap and the first impact.
std::vector<double> first_impact(const SolverSettings& solver) {
  Plant plant(test::sarkar_rig(30e-6), test::square(kTorque, 10), solver);
  std::vector<double> torque;
  for (int k = 1; k <= 50; ++k) {
    plant.advance_to(k * 1e-4);
    torque.push_back(plant.observe().sensor_torque);
  }
  return torque;
}

TEST(PlantMotion, FirstImpactConvergesWithTheTolerance) {
  const std::vector<double> exact = first_impact(test::solver(1e-13));
  for (const std::string& method : integrator_methods()) {
    for (double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
      const std::vector<double> torque = first_impact(test::solver(tolerance, method));
      double error = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) error = std::max(error, std::fabs(torque[i] - exact[i]));
      // N m, where the torque reaches 0.1; measured 0.01 to 1.6 tolerances over all methods
      EXPECT_LT(error, 5 * tolerance) << method << " at " << tolerance;
    }
  }
}

TEST(PlantMotion, TurningFarDoesNotBlurTheMesh) {
  const model::Rig rig = with_free_link(test::sarkar_rig(30e-6));
  Plant near(rig, test::square(kTorque, 10), test::solver(1e-6));
  Plant far(rig, test::square(kTorque, 10), test::solver(1e-6));
  Plant::State turned{};
  for (int i = 0; i < 4; ++i) turned[i] = 1e4;  // rad
  far.set_state(turned);
  for (int k = 1; k <= 200; ++k) {
    near.advance_to(k * 1e-3);
    far.advance_to(k * 1e-3);
    EXPECT_NEAR(far.observe().sensor_torque, near.observe().sensor_torque, 1e-4) << k;
  }
}

TEST(PlantMotion, AMotorSideRigMovesAsItsLoadSideTwin) {
  const double n = 50;
  model::Rig motor_side = test::sarkar_rig(30e-6), load_side = motor_side;
  motor_side.reduction_ratio = n;
  motor_side.motor_side = true;
  for (model::Body* body : {&load_side.motor, &load_side.pinion})
    body->inertia *= n * n, body->viscous_damping *= n * n;
  load_side.input_coupling.stiffness *= n * n;
  load_side.input_coupling.damping *= n * n;
  Plant a(motor_side, test::square(kTorque, 10), test::solver(1e-9));
  Plant b(load_side, test::square(kTorque * n, 10), test::solver(1e-9));
  for (int k = 1; k <= 100; ++k) {
    a.advance_to(k * 1e-3);
    b.advance_to(k * 1e-3);
    EXPECT_NEAR(a.observe().motor_position, n * b.observe().motor_position, 1e-7);
    EXPECT_NEAR(a.observe().sensor_torque, b.observe().sensor_torque / n, 1e-6);
    EXPECT_EQ(a.observe().motor_torque, b.observe().motor_torque / n);
  }
}

}  // namespace
}  // namespace backlash::simulation
