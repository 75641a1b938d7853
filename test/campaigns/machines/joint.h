// SPDX-License-Identifier: BSD-3-Clause
// A robot's joint with one encoder, in a closed position loop, under ordinary motion:
//   J q'' = L - gravity(q),  L = u - friction - cogging
// with friction on the motor's side of the gear, where a share of it may follow the torque L that the load
// takes. Torque is a current: N m reads A throughout. Shares nothing with the package that is tested.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "machine.h"
#include "random.h"

namespace machines {

/// Sines over time that follow nothing of the machine's state.
struct Swings {
  struct Sine {
    double amplitude, frequency, phase;  // any unit, rad/s, rad
  };
  std::vector<Sine> sines;
  double value(double time) const;
};

struct Joint {
  double inertia = 0;
  Friction friction;
  double friction_build_up = 5e-5;  // rad, over which friction turns round
  Wave cogging;
  Gravity gravity;
  Swings outside, friction_swing;        // A, from outside; -, of the Coulomb friction
  double more_gravity = 0, more_at = 0;  // -, s: a load that is taken up
  double rate = 100, jitter = 0;         // Hz; relative, of a sample's time
  double noise = 0, step = 0.005;        // A, of the current that the loop asks for and of its steps
  double resolution = 1e-6;              // rad
};

struct JointRow {
  double time, current, position;
};

struct JointEffect {
  std::string id;
  bool outside;                                                                      // of every dictionary
  nlohmann::ordered_json (*add)(Random&, double strength, double duration, Joint&);  // says what it drew
};
const std::vector<JointEffect>& joint_effects();

/// A joint as robots have them. `rate` 0: drawn from 100, 125, 250 and 500 Hz.
Joint draw_joint(Random& random, double rate);

/// From rest, under moves from place to place with pauses, or slow sines. Current and angle are written as
/// the loop and the encoder see them, noise and steps included.
std::vector<JointRow> run_joint(const Joint& joint, bool moves, double duration, Random& random);

void write_csv(const std::vector<JointRow>& rows, const std::string& path);

}  // namespace machines
