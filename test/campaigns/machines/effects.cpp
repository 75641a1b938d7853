// SPDX-License-Identifier: BSD-3-Clause
#include "effects.h"

#include <stdexcept>

namespace machines {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMillisecond = 1e-3;  // s

Wave draw_wave(Random& random, const Circumstances& circumstances, double smallest, double largest,
               int first_order, int last_order) {
  const double amplitude = circumstances.strength * random.uniform(smallest, largest);
  const int order = random.whole(first_order, last_order);
  return {amplitude, circumstances.order > 0 ? circumstances.order : order, random.phase()};
}

Json describe(const std::string& where, const std::string& equation, const Wave& wave) {
  return {{where, equation}, {"A", wave.amplitude}, {"n", wave.order}, {"p", wave.phase}};
}

double inside(Random& random, const Travel& travel) {
  return travel.from + (travel.to - travel.from) * random.uniform(0.25, 0.75);
}

Json asymmetric_coulomb(Random& random, const Circumstances& circumstances, Machine& machine) {
  Friction& f = machine.motor.friction;
  f.asymmetric_coulomb = circumstances.strength * random.sign() * random.uniform(0.1, 0.3) * f.coulomb;
  return {{"motor friction", "Coulomb + A forward, Coulomb - A backward"}, {"A", f.asymmetric_coulomb}};
}

Json asymmetric_viscous(Random& random, const Circumstances& circumstances, Machine& machine) {
  double& more = machine.motor.friction.asymmetric_viscous;
  more = circumstances.strength * random.uniform(25, 70);
  return {{"motor friction", "+ A*w where w > 0"}, {"A", more}};
}

Json stribeck(Random& random, const Circumstances& circumstances, Machine& machine) {
  Friction& f = machine.motor.friction;
  f.stribeck = circumstances.strength * random.uniform(0.35, 0.7) * f.coulomb;
  f.stribeck_speed = random.uniform(0.015, 0.05);
  return {{"motor friction", "+ A*exp(-(w/ws)^2)*sign(w)"}, {"A", f.stribeck}, {"ws", f.stribeck_speed}};
}

Json quadratic_drag(Random& random, const Circumstances& circumstances, Machine& machine) {
  const bool at_motor = random.chance(0.5);
  double& drag = (at_motor ? machine.motor : machine.load).friction.quadratic;
  drag = circumstances.strength * random.uniform(50, 140);
  return {{at_motor ? "motor friction" : "load friction", "+ A*w*abs(w)"}, {"A", drag}};
}

Json square_root_friction(Random& random, const Circumstances& circumstances, Machine& machine) {
  const bool at_motor = random.chance(0.5);
  double& friction = (at_motor ? machine.motor : machine.load).friction.square_root;
  friction = circumstances.strength * random.uniform(25, 60);
  return {{at_motor ? "motor friction" : "load friction", "+ A*sqrt(abs(w))*sign(w)"}, {"A", friction}};
}

Json load_dependent_friction(Random& random, const Circumstances& circumstances, Machine& machine) {
  double& share = machine.motor.friction.load_dependent;
  share = circumstances.strength * random.uniform(0.05, 0.15);
  return {{"motor friction", "+ A*abs(T)*sign(w), T = torque through the mesh"}, {"A", share}};
}

Json position_dependent_friction(Random& random, const Circumstances& circumstances, Machine& machine) {
  Wave& wave = machine.motor.friction.position;
  wave = draw_wave(random, circumstances, 0.2, 0.45, 2, 40);
  return describe("motor friction", "Coulomb*(1 + A*sin(n*q+p)), q = motor position", wave);
}

Json friction_drift(Random& random, const Circumstances& circumstances, Machine& machine) {
  double& rate = machine.motor.friction.drift;
  rate = circumstances.strength * random.sign() * random.uniform(0.25, 0.5) / circumstances.duration;
  return {{"motor friction", "Coulomb*(1 + A*t), t = time in the record"}, {"A", rate}};
}

Json gravity(Random& random, const Circumstances& circumstances, Machine& machine) {
  machine.gravity = {circumstances.strength * random.uniform(25, 80),
                     random.uniform(-Random::kPi, Random::kPi)};
  return {{"load torque", "A*sin(q+p), q = load position, opposing"},
          {"A", machine.gravity.amplitude},
          {"p", machine.gravity.phase}};
}

Json cogging(Random& random, const Circumstances& circumstances, Machine& machine) {
  machine.drive.cogging = draw_wave(random, circumstances, 9, 25, 12, 72);
  return describe("motor torque", "A*sin(n*q+p), q = motor position, opposing", machine.drive.cogging);
}

Json transmission_error(Random& random, const Circumstances& circumstances, Machine& machine) {
  machine.mesh.transmission_error = draw_wave(random, circumstances, 4e-5, 8e-5, 6, 60);
  return describe("mesh displacement", "+ A*sin(n*q+p), q = load position [rad]",
                  machine.mesh.transmission_error);
}

Json varying_backlash(Random& random, const Circumstances& circumstances, Machine& machine) {
  const Wave first = draw_wave(random, circumstances, 0.15, 0.4, 1, 12);
  machine.mesh.gap = {first};
  Json drawn{{"backlash_angle(q)", "b*(1 + a1*sin(n1*q+p1)), q = load position"},
             {"a1", first.amplitude},
             {"n1", first.order},
             {"p1", first.phase}};
  if (random.chance(0.5) || circumstances.order > 0) return drawn;
  Wave second = draw_wave(random, circumstances, 0.08, 0.2, 1, 11);
  if (second.order >= first.order) ++second.order;
  machine.mesh.gap.push_back(second);
  drawn["backlash_angle(q)"] = "b*(1 + a1*sin(n1*q+p1) + a2*sin(n2*q+p2)), q = load position";
  drawn["a2"] = second.amplitude;
  drawn["n2"] = second.order;
  drawn["p2"] = second.phase;
  return drawn;
}

Json mesh_hardening(Random& random, const Circumstances& circumstances, Machine& machine) {
  Mesh& mesh = machine.mesh;
  const double penetration = mesh.working_torque / mesh.stiffness;
  mesh.hardening = circumstances.strength * random.uniform(0.25, 0.6) / (penetration * penetration);
  return {{"torque of a flank", "k*d*(1 + A*d^2), d = penetration [rad]"}, {"A", mesh.hardening}};
}

// The other reading, a speed ratio that varies and so lets the angles creep apart, is in no dictionary:
// creep.
Json varying_reduction_ratio(Random& random, const Circumstances& circumstances, Machine& machine) {
  double& change = machine.mesh.ratio_per_torque;
  change = circumstances.strength * random.sign() * random.uniform(2.5e-7, 6e-7);
  return {{"motor angle at the mesh", "q*(1 + A*T), T = torque through the mesh"}, {"A", change}};
}

Json encoder_scale(Random& random, const Circumstances& circumstances, Machine& machine) {
  const double error = circumstances.strength * random.sign() * random.uniform(8e-5, 3e-4);
  machine.sensors.load_gain = 1 + error;
  return {{"load encoder", "shows (1 + A)*q"}, {"A", error}};
}

Json delay(Random& random, const Circumstances& circumstances, Machine& machine) {
  machine.sensors.latency = circumstances.strength * random.uniform(1, 4) * kMillisecond;
  return {{"torque", "acts A [s] after its stamp, against both angles"}, {"A", machine.sensors.latency}};
}

Json presliding(Random& random, const Circumstances& circumstances, Machine& machine) {
  Friction& f = machine.motor.friction;
  f.bristle_length = circumstances.strength * random.uniform(4e-4, 1.5e-3);
  f.bristle_damping = 0;
  return {{"motor friction", "Dahl: Coulomb*z, z' = (w - abs(w)*z)/A"}, {"A", f.bristle_length}};
}

Json local_fault(Random& random, const Circumstances& circumstances, Machine& machine) {
  Bump& fault = machine.mesh.gap_fault;
  fault = {circumstances.strength * random.uniform(3e-4, 7e-4), inside(random, circumstances.travel),
           random.uniform(0.04, 0.1)};
  return {{"backlash_angle(q)", "b + A*exp(-((q-c)/s)^2), q = load position"},
          {"A", fault.height},
          {"c", fault.centre},
          {"s", fault.width}};
}

Json torque_saturation(Random& random, const Circumstances&, Machine& machine) {
  double& limit = machine.drive.saturation;
  limit = random.uniform(350, 700);
  return {{"torque of the motor", "tau/(1 + (tau/A)^4)^(1/4), tau = recorded"}, {"A", limit}};
}

Json slipping_coupling(Random& random, const Circumstances&, Machine& machine) {
  machine.mesh.slip_torque = random.uniform(300, 500);
  machine.mesh.slip_damping = random.uniform(5e4, 2e5);
  return {{"coupling behind the mesh", "slips with (abs(T) - A)/c where abs(T) > A"},
          {"A", machine.mesh.slip_torque},
          {"c", machine.mesh.slip_damping}};
}

Json damaged_tooth(Random& random, const Circumstances& circumstances, Machine& machine) {
  Mesh& mesh = machine.mesh;
  mesh.damage_depth = random.uniform(2e-4, 4e-4);
  mesh.damage_centre = inside(random, circumstances.travel);
  mesh.damage_width = random.uniform(0.08, 0.16);
  mesh.damage_softening = random.uniform(0.3, 0.6);
  return {{"forward flank", "at x = max(0, 1 - abs(q-c)/s): A*x deeper, stiffness times 1 - B*x"},
          {"A", mesh.damage_depth},
          {"B", mesh.damage_softening},
          {"c", mesh.damage_centre},
          {"s", mesh.damage_width}};
}

Json thermal_growth(Random& random, const Circumstances& circumstances, Machine& machine) {
  machine.mesh.thermal_growth = random.sign() * random.uniform(0.3, 0.6);
  machine.mesh.thermal_time = circumstances.duration * random.uniform(0.15, 0.4);
  return {{"backlash_angle(t)", "b*(1 + A*(1 - exp(-t/s)))"},
          {"A", machine.mesh.thermal_growth},
          {"s", machine.mesh.thermal_time}};
}

Json speed_ripple(Random& random, const Circumstances& circumstances, Machine& machine) {
  machine.drive.speed_ripple = draw_wave(random, circumstances, 80, 200, 8, 40);
  return describe("motor torque", "A*w*abs(w)*sin(n*q+p), q = motor position, opposing",
                  machine.drive.speed_ripple);
}

Json creep(Random& random, const Circumstances&, Machine& machine) {
  double& creep = machine.mesh.creep_per_torque;
  creep = random.uniform(5e-6, 1.5e-5);
  return {{"load angle", "falls back by A*T*abs(w) dt, T = torque through the mesh"}, {"A", creep}};
}

Json two_gaps(Random& random, const Circumstances&, Machine& machine) {
  SecondStage& second = machine.second;
  second.backlash = machine.mesh.backlash * random.uniform(0.5, 1);
  second.wheel.inertia = random.uniform(0.3, 0.8);
  second.wheel.friction.coulomb = random.uniform(10, 40);
  return {{"a wheel between two meshes",
           "backlash_angle b and A, both twice as stiff and damped, inertia J, friction C"},
          {"A", second.backlash},
          {"J", second.wheel.inertia},
          {"C", second.wheel.friction.coulomb}};
}

}  // namespace

const std::vector<Effect>& all_effects() {
  static const std::vector<Effect> effects{
      {"asymmetric_coulomb", true, {"torque_offset"}, asymmetric_coulomb},
      {"asymmetric_viscous", true, {}, asymmetric_viscous},
      {"stribeck", true, {}, stribeck},
      {"quadratic_drag", true, {}, quadratic_drag},
      {"square_root_friction", true, {}, square_root_friction},
      {"load_dependent_friction", true, {}, load_dependent_friction},
      {"position_dependent_friction", true, {}, position_dependent_friction},
      {"friction_drift", true, {}, friction_drift},
      {"gravity", true, {}, gravity},
      {"cogging", true, {}, cogging},
      {"transmission_error", true, {}, transmission_error},
      {"varying_backlash", true, {}, varying_backlash},
      {"mesh_hardening", true, {}, mesh_hardening},
      {"varying_reduction_ratio", true, {}, varying_reduction_ratio},
      {"encoder_scale", true, {"transmission_error"}, encoder_scale},
      {"delay", true, {}, delay},
      {"presliding", true, {}, presliding},
      {"local_fault", true, {}, local_fault},
      {"torque_saturation", false, {}, torque_saturation},
      {"slipping_coupling", false, {}, slipping_coupling},
      {"damaged_tooth", false, {}, damaged_tooth},
      {"thermal_growth", false, {}, thermal_growth},
      {"speed_ripple", false, {}, speed_ripple},
      {"creep", false, {}, creep},
      {"two_gaps", false, {}, two_gaps},
  };
  return effects;
}

const Effect& effect(const std::string& id) {
  for (const Effect& effect : all_effects()) {
    if (effect.id == id) return effect;
  }
  throw std::invalid_argument("no such effect: " + id);
}

}  // namespace machines
