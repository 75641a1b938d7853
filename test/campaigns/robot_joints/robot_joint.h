// SPDX-License-Identifier: BSD-3-Clause
// A robot's joint with two encoders in a cascaded position loop, as a bag of ROS shows it. Shares nothing
// with the package that is tested. All at the load side of the reduction, SI units:
//   J_r w_r' = tau - friction_m - cogging - R,      R = k_r (x_r - x_p) + c_r (w_r - w_p)
//   J_p w_p' = R - T(x_p - x_w)
//   J_w w_w' = T - S,   J_l w_l' = S - friction_l - G sin(x_l + p),   S = k_s (x_w - x_l) + c_s (w_w - w_l)
// a rotor, a pinion behind a shaft (or on the rotor), the wheel behind the teeth and the load behind a shaft:
// teeth and shafts together have the stiffness K. The output's bearing and encoder are at the load, or at the
// wheel's flange: friction_l then acts on the wheel, whose position is shown.
#pragma once

#include <string>
#include <vector>

#include "../machines/random.h"

namespace robot_joints {

using machines::Random;

/// What a rig file declares, and what is true.
struct Values {
  double load_inertia, motor_inertia, stiffness, backlash, motor_viscous, motor_coulomb, load_viscous,
      load_coulomb, damping, gravity, gravity_phase;
};

enum class Teeth { linear, hertz, cubic, hysteresis };

/// Where the compliance and the inertia are; all of the rig file's are in one place.
struct Masses {
  double pinion = 0, input_shaft = 0;     // of the motor's inertia, of the stiffness; 0: on the rotor
  double wheel = 0.04, output_shaft = 5;  // of the load's inertia, of the stiffness
  bool flange = false;                    // bearing and encoder at the wheel
};

/// One that the rig file does not know, "" for none; ids are the package's.
struct Effect {
  std::string id;
  double size = 0;   // N m, rad, or a share: of the torque through the teeth, of the play
  double order = 0;  // per turn of the load, of what comes again with a position
  double speed = 0;  // rad/s, of Stribeck's friction
  double phase = 0;  // rad
};

struct Machine {
  Values declared, real;
  double ratio = 100;
  Teeth teeth = Teeth::linear;
  double power = 1;                       // of the deflection, of Teeth::hertz and Teeth::hysteresis
  double at = 10;                         // N m, torque at which all laws are as stiff as `stiffness`
  double hysteresis = 0;                  // -, share of the torque that the direction of the deflection takes
  bool bristles = false;                  // LuGre in place of Coulomb friction on the motor
  double cogging = 0, cogging_order = 0;  // N m, per turn of the load
  Masses masses;
  Effect effect;
  // Sensors: torque from current, encoders.
  double gain = 1, offset = 0, ripple = 0, lag = 0, noise = 0, step = 0.05;  // -, N m, -, s, N m, N m
  double motor_resolution = 4.8e-7, load_resolution = 1.2e-5;                // rad
  double eccentricity = 0, eccentricity_phase = 0, interpolation = 0, interpolation_order = 512;  // rad
  double skew = 0;                     // s, the load encoder is late
  double zero = 0;                     // rad, of the load's encoder against the motor's
  double jitter = 0.05, lost = 0.002;  // of an interval, of the samples
  double rate = 1000;                  // Hz
};

Machine draw_machine(Random& random);
Masses draw_masses(Random& random);

/// The same with mild errors of the sensors, and with an effect that its rig file does not know: one of
/// effect_ids(). `own_teeth`: with the teeth and the friction that it was drawn with, else with linear teeth
/// and Coulomb friction.
Machine with_effect(Machine machine, const std::string& id, bool own_teeth, Random& random);
const std::vector<std::string>& effect_ids();

struct Row {
  double time, torque, motor, load;
};

struct Run {
  std::vector<Row> rows;
  int crossings = 0;                 // of the gap, from flank to flank
  double forward = 0, backward = 0;  // shares of the time that each flank is pressed
  double most_torque = 0;            // N m, through the teeth
};

/// `kind`: pick, sine, multi or via.
Run run(const Machine& machine, const std::string& kind, double duration, Random& random);

/// Stamps that are off by so much of an interval beside what the samples are (standard deviation, at most
/// half of one), as of a message that is stamped when it arrives.
void jitter_stamps(Run& run, double share, double rate, Random& random);

std::string rig_file(const Machine& machine, const std::string& name);
std::string truth(const Machine& machine, const std::vector<std::pair<std::string, Run>>& runs);

}  // namespace robot_joints
