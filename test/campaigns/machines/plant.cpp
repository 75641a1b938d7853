// SPDX-License-Identifier: BSD-3-Clause
#include "plant.h"

#include <algorithm>
#include <cmath>

namespace machines {
namespace {

/// What the motor makes of the torque it is asked for: soft at its limit.
double saturated(double torque, double limit) {
  if (limit == 0) return torque;
  const double ratio = torque / limit;
  return torque / std::pow(1 + ratio * ratio * ratio * ratio, 0.25);
}

/// 1 in the middle of the damaged tooth, 0 at its edges, straight between.
double damage(const Mesh& mesh, double q) {
  return std::max(0.0, 1 - std::abs(q - mesh.damage_centre) / mesh.damage_width);
}

}  // namespace

double Plant::half_gap(int side, double* slope) const {
  const Mesh& mesh = machine_.mesh;
  const double q = load_.position;
  double gap = 1, relative_slope = 0;
  for (const Wave& wave : mesh.gap) {
    gap += wave.value(q);
    relative_slope += wave.slope(q);
  }
  if (mesh.thermal_growth != 0) gap += mesh.thermal_growth * (1 - std::exp(-time_ / mesh.thermal_time));
  double half = mesh.backlash / 2 * gap;
  *slope = mesh.backlash / 2 * relative_slope;
  if (mesh.gap_fault.height != 0) {
    half += mesh.gap_fault.value(q) / 2;
    *slope += mesh.gap_fault.slope(q) / 2;
  }
  if (side > 0 && mesh.damage_depth != 0) {
    const double depth = damage(mesh, q);
    half += mesh.damage_depth * depth;
    if (depth > 0) *slope += std::copysign(mesh.damage_depth / mesh.damage_width, mesh.damage_centre - q);
  }
  return half;
}

double Plant::law(double penetration, double rate, double softening) const {
  const Mesh& mesh = machine_.mesh;
  double torque;
  if (mesh.hertz) {
    const double working = mesh.working_torque / mesh.stiffness;  // rad
    torque = mesh.stiffness * penetration * std::sqrt(penetration / working) *
             (1 + mesh.damping / mesh.working_torque * rate);
  } else {
    torque =
        mesh.stiffness * penetration * (1 + mesh.hardening * penetration * penetration) + mesh.damping * rate;
  }
  return std::max(0.0, torque * (1 - softening));
}

double Plant::flank(int side, double displacement, double rate, double* gap_slope) const {
  const double penetration = side * displacement - half_gap(side, gap_slope);
  if (penetration <= 0) return 0;
  const double softening =
      side > 0 ? machine_.mesh.damage_softening * damage(machine_.mesh, load_.position) : 0;
  return law(penetration, side * rate - *gap_slope * load_.speed, softening);
}

/// Linear teeth with nothing odd about them, twice as stiff as declared.
double Plant::simple_mesh(double backlash, const State& driving, const State& driven) const {
  const double displacement = driving.position - driven.position, rate = driving.speed - driven.speed;
  const double penetration = std::abs(displacement) - backlash / 2;
  if (penetration <= 0) return 0;
  const int side = displacement > 0 ? 1 : -1;
  const Mesh& mesh = machine_.mesh;
  return side * std::max(0.0, 2 * (mesh.stiffness * penetration + mesh.damping * side * rate));
}

Plant::MeshTorques Plant::two_meshes() const {
  const double first = simple_mesh(machine_.mesh.backlash, motor_, wheel_);
  const double second = simple_mesh(machine_.second.backlash, wheel_, load_);
  return {first, -first, first - second, second};
}

// Every flank acts on both bodies by virtual work: penetration = side * displacement - half gap.
Plant::MeshTorques Plant::mesh() const {
  if (machine_.second.backlash != 0) return two_meshes();
  const Mesh& mesh = machine_.mesh;
  const double ratio = 1 + mesh.ratio_per_torque * mesh_torque_;
  const double error_slope = mesh.transmission_error.slope(load_.position);
  const double displacement =
      motor_.position * ratio - load_.position - slip_ + mesh.transmission_error.value(load_.position);
  const double rate = motor_.speed * ratio - load_.speed * (1 - error_slope);
  double forward_slope, backward_slope;
  const double forward = flank(1, displacement, rate, &forward_slope);
  const double backward = flank(-1, displacement, rate, &backward_slope);
  const double torque = forward - backward;
  return {torque, -torque * ratio, 0,
          torque * (1 - error_slope) + forward * forward_slope + backward * backward_slope};
}

void Plant::slip(double length) {
  const Mesh& mesh = machine_.mesh;
  if (mesh.slip_torque != 0) {
    const double excess = std::max(0.0, std::abs(mesh_torque_) - mesh.slip_torque);
    slip_ += std::copysign(excess / mesh.slip_damping, mesh_torque_) * length;
  }
  slip_ += mesh.creep_per_torque * mesh_torque_ * std::abs(motor_.speed) * length;
}

/// The torque that friction without bristles has in this direction of motion.
double Plant::friction_limit(const Friction& f, const State& state, int direction) const {
  const double speed = state.speed;
  double limit = f.coulomb * (1 + f.position.value(state.position) + f.drift * time_) +
                 direction * f.asymmetric_coulomb + f.load_dependent * std::abs(mesh_torque_);
  if (f.square_root != 0) limit += f.square_root * std::sqrt(std::abs(speed));
  if (f.stribeck != 0) limit += f.stribeck * std::exp(-std::pow(speed / f.stribeck_speed, 2));
  return std::max(0.0, limit);
}

void Plant::accelerate(const Body& body, double torque, double length, State* state) const {
  const Friction& f = body.friction;
  const double speed = state->speed;
  torque -= f.viscous * speed + f.quadratic * speed * std::abs(speed);
  if (speed > 0) torque -= f.asymmetric_viscous * speed;
  if (f.bristle_length != 0) {
    const double limit = friction_limit(f, *state, state->bristle < 0 ? -1 : 1);
    // z of LuGre over its largest value; implicit, so that it never exceeds 1
    const double before = state->bristle;
    state->bristle =
        (before + length * speed / f.bristle_length) / (1 + length * std::abs(speed) / f.bristle_length);
    torque -=
        limit * state->bristle + f.bristle_damping * f.bristle_length * (state->bristle - before) / length;
    state->speed = speed + length * torque / body.inertia;
    return;
  }
  const double free = speed + length * torque / body.inertia;
  const int direction = free < 0 ? -1 : 1;
  const double stop = length * friction_limit(f, *state, direction) / body.inertia;
  state->speed = direction * std::max(0.0, std::abs(free) - stop);
}

/// Speeds after `length` under the teeth as they are.
void Plant::push(double torque, const MeshTorques& teeth, double length) {
  const Drive& drive = machine_.drive;
  const double speed = motor_.speed;
  const double ripple = drive.cogging.value(motor_.position) +
                        drive.speed_ripple.value(motor_.position) * speed * std::abs(speed);
  accelerate(machine_.motor, saturated(torque, drive.saturation) - ripple + teeth.motor, length, &motor_);
  const double weight = machine_.gravity.amplitude == 0
                            ? 0
                            : machine_.gravity.amplitude * std::sin(load_.position + machine_.gravity.phase);
  if (machine_.second.backlash != 0) accelerate(machine_.second.wheel, teeth.wheel, length, &wheel_);
  accelerate(machine_.load, teeth.load - weight, length, &load_);
}

/// On at the speeds that the bodies have.
void Plant::drift(double length) {
  for (State* body : {&motor_, &wheel_, &load_}) body->position += length * body->speed;
  time_ += length;
}

void Plant::step(double torque, double length) {
  drift(length / 2);
  // The teeth act with the speeds of the middle of the step: with those of its start their damping b would
  // take b length / 2 from the inertia of the motor.
  const State motor = motor_, wheel = wheel_, load = load_;
  push(torque, mesh(), length / 2);
  const MeshTorques teeth = mesh();
  motor_ = motor;
  wheel_ = wheel;
  load_ = load;
  mesh_torque_ = teeth.through;
  slip(length);
  push(torque, teeth, length);
  drift(length / 2);
}

}  // namespace machines
