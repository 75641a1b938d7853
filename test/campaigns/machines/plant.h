// SPDX-License-Identifier: BSD-3-Clause
// How a machine moves: Verlet steps with friction as in Moreau's time stepping (the impulse of friction stops
// a body exactly, and holds it). Shares nothing with the package that is tested.
#pragma once

#include "machine.h"

namespace machines {

class Plant {
 public:
  explicit Plant(const Machine& machine) : machine_(machine) {}

  /// One step [s] under the torque [N m] that the drive is asked for.
  void step(double torque, double length);

  double time() const { return time_; }
  double motor_position() const { return motor_.position; }
  double motor_speed() const { return motor_.speed; }
  double load_position() const { return load_.position; }
  double load_speed() const { return load_.speed; }
  double mesh_torque() const { return mesh_torque_; }

 private:
  struct State {
    double position = 0, speed = 0, bristle = 0;
  };
  struct MeshTorques {
    double through = 0, motor = 0, wheel = 0, load = 0;  // N m
  };

  double half_gap(int side, double* slope) const;
  double flank(int side, double displacement, double rate, double* gap_slope) const;
  double law(double penetration, double rate, double softening) const;
  MeshTorques mesh() const;
  MeshTorques two_meshes() const;
  double simple_mesh(double backlash, const State& driving, const State& driven) const;
  void slip(double length);
  void drift(double length);
  void push(double torque, const MeshTorques& teeth, double length);
  void accelerate(const Body& body, double torque, double length, State* state) const;
  double friction_limit(const Friction& friction, const State& state, int direction) const;

  Machine machine_;
  State motor_, wheel_, load_;
  double time_ = 0;
  double mesh_torque_ = 0;  // N m
  double slip_ = 0;         // rad, coupling and creep
};

}  // namespace machines
