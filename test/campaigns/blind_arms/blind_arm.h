// SPDX-License-Identifier: BSD-3-Clause
// Arms that this package has not made: values of a chain with geared drives, drawn, and what the rig file
// says of them. Nothing here knows the package's own model of an arm.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace blind_arms {

using Vector = std::array<double, 3>;

/// How the teeth yield once the gap is closed by `depth` [rad].
enum class Teeth { spring, power, hardening };

/// size sin(order x + phase)
struct Wave {
  double size = 0, order = 1, phase = 0;
  double at(double x) const { return size == 0 ? 0 : size * std::sin(order * x + phase); }
};

/// A joint, its drive, and the link that it turns; all at the joint's side of the reduction.
struct Joint {
  Vector axis = {0, 1, 0}, place = {0, 0, 0};  // m, in the frame of the joint before
  double mass = 0;                             // kg
  Vector centre = {0, 0, 0};                   // m
  Vector inertia = {0, 0, 0};                  // kg m^2 about the centre, along the axes of the frame
  double rotor = 0;                            // kg m^2
  double coulomb = 0, viscous = 0;             // of the motor: N m, N m s/rad
  double stribeck = 0, stribeck_speed = 0.1;   // share of Coulomb's that vanishes, rad/s
  double bristle = 5e-4;                       // rad, deflection at Coulomb's friction
  double link_coulomb = 0, link_viscous = 0;   // of the link
  Teeth teeth = Teeth::spring;
  double stiffness = 0, damping = 0;             // N m/rad, N m s/rad
  double play = 0;                               // rad
  double bend_stiffness = 0, bend_damping = 0;   // of a link that bends about the joint's axis; 0: rigid
  double flange = 0;                             // kg m^2, before the bend
  double eccentricity = 0, eccentric_phase = 0;  // rad, of the link's encoder
  std::array<double, 2> waves = {0, 0}, wave_phases = {0, 0};  // rad, the same twice and three times per turn
  double transmission = 0,
         transmission_phase = 0;  // rad, of the motor's encoder, `transmission_order` per turn
  int transmission_order = 30;
  Wave cogging, ripple;                         // of torque, of friction: N m
  double breakaway = 0, breakaway_speed = 0.1;  // N m, rad/s: as Stribeck's
  double drag = 0, lopsided = 0;                // N m s^2/rad^2, N m s/rad: v |v|, |v|
  double rubbing = 0;                           // friction over the teeth's torque
  double coupling = 0;                          // of the motor of joint `coupled`
  std::size_t coupled = 0;
  double gain = 1;                                              // torque over what the record shows
  double cable = 0;                                             // N m/rad
  double spot = 0, spot_place = 0, spot_width = 1;              // N m of friction, rad
  double drift = 0;                                             // 1/s, by which Coulomb friction grows
  double zero = 0;                                              // rad, of the link's encoder
  double lower = 0, upper = 0;                                  // rad, of the motion
  double position_gain = 0, speed_gain = 0, integral_gain = 0;  // 1/s, N m s/rad, 1/s
  double torque_noise = 0, slow_noise = 0;                      // N m, white and coloured
};

/// Of a flange's inertia, about its other axes: a disc has a half, and is flat.
constexpr double kDisc = 0.55;

struct Push {
  double begin = 0, end = 0;  // s
  Vector force = {0, 0, 0};   // N, on the centre of the last link
};

/// What the rig file says, as factors of the truth.
struct DeclaredJoint {
  double mass = 1, centre = 1, friction = 1, link_friction = 1, rotor = 1, stiffness = 1;
};

/// What should be reported: an effect by the package's name; strength and shape in its units.
struct Added {
  std::string effect;
  std::size_t joint = 0;
  double strength = 0, shape = 0;
};

struct Arm {
  std::uint64_t seed = 0;
  std::vector<Joint> joints;
  std::vector<DeclaredJoint> declared;
  double rate = 1000;                    // Hz, of the record
  double late = 0;                       // s, of the link's encoders
  double motor_noise = 0;                // rad
  double link_noise = 0, link_step = 0;  // rad
  bool backwards = false;                // the link's encoders count the other way
  bool series = false;                   // the motion: sums of sines, else moves from pose to pose
  double reach = 1, haste = 1;           // of the motion
  double payload = 0;                    // kg, undeclared, on the last link
  Vector payload_centre = {0, 0, 0};     // m
  double tilt = 0;                       // rad, of the base about y, undeclared
  std::size_t changed = 0;               // joint whose friction is `more_friction` times what it was
  double more_friction = 1;
  std::vector<Push> pushes;
  std::vector<Added> added;  // see flaws.h
};

/// What the rig file does not know, beside the errors of all: see kinds().
Arm drawn_arm(std::uint64_t seed, const std::string& kind);

struct Kind {
  std::string name, help;
};
/// For plays, and for changes since the training records.
const std::vector<Kind>& kinds();
const std::vector<Kind>& changes();

/// Moments of gravity and inertia of all that a joint carries, the arm stretched out [N m, kg m^2].
double carried_weight(const Arm& arm, std::size_t joint);
double carried_inertia(const Arm& arm, std::size_t joint);

/// Torque of the teeth at a twist between motor and link [N m], and the energy in them [J].
double teeth_torque(const Joint& joint, double twist, double rate);
double teeth_energy(const Joint& joint, double twist);

}  // namespace blind_arms
