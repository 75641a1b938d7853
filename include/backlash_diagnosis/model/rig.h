// SPDX-License-Identifier: BSD-3-Clause
// What the machine is: the declared parameters of one gear train, as its rig file gives them.
//
//   motor - [input coupling = torque sensor] - pinion | mesh | gear - [output coupling] - link
//
// Couplings in brackets may be rigid, then their neighbours move as one. The link is free or locked.
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/model/contact_law.h"
#include "backlash_diagnosis/model/stiffness_variation.h"
#include "backlash_diagnosis/model/term.h"
#include "backlash_diagnosis/model/tooth_pairs.h"

namespace backlash::model {

/// A rotating part and its friction against the frame:
///   T = c w + a |w| + F sign(w) + b        c, F: means of both directions; a, b: half differences
/// Forward c + a and F + b, backward c - a and F - b, none below 0. At rest dry friction takes any value
/// between
/// -(F - b) and F + b: the body sticks.
struct Body {
  double inertia = 0;            // kg m^2
  double viscous_damping = 0;    // c, N m s/rad
  double viscous_asymmetry = 0;  // a, N m s/rad
  double coulomb_friction = 0;   // F, N m, motor and link only
  double coulomb_asymmetry = 0;  // b, N m
};

/// A flexible shaft or torque sensor; half of its inertia moves with either end.
struct Coupling {
  bool rigid = true;
  double stiffness = 0;  // N m/rad
  double damping = 0;    // N m s/rad
  double inertia = 0;    // kg m^2
};

/// Tooth contact. `backlash` is the total free play along the line of action [m]; for a rig without base
/// radius it is the angle at the load side [rad] and the contact law works with angles and torques.
struct Mesh {
  bool rigid = false;  // no mesh: the gear moves with the pinion, the rest of this does not count
  double backlash = 0;
  double base_radius = std::numeric_limits<double>::quiet_NaN();  // m, of the load gear; NaN: angular mesh
  double start_in_gap =
      0;  // -, where in the gap both positions are 0: +1 at the flank that drives forward, -1 at the other
  std::shared_ptr<const ContactLaw> contact;
  std::shared_ptr<const StiffnessVariation> variation;  // null: the same stiffness in every position
  std::shared_ptr<const ToothPairs> pairs;              // null: one mesh; not beside a variation

  bool angular() const { return std::isnan(base_radius); }
  double lever() const { return angular() ? 1 : base_radius; }  // m (or 1): torque per contact force
  /// m (angular: rad), one turn: an upper limit for a declared backlash.
  double most_backlash() const { return 2 * M_PI * lever(); }
  const ContactSpec& contact_spec() const;  // what `contact` was made of; empty without one
};

/// A validated rig. Motor, input coupling and pinion are given as seen from the load side of the reduction
/// unless `motor_side` is true; then they, and motor_torque, motor_position and sensor_torque of its records,
/// are those of the motor shaft.
struct Rig {
  std::string name;
  std::string joint;           // prefix of its names in sensor_msgs/JointState
  double reduction_ratio = 1;  // motor turns per load turn, > 0
  bool motor_side = false;
  bool linear = false;  // a linear axis: m, kg, N stand where a rotary one has rad, kg m^2, N m
  Body motor, pinion, gear, link;
  double torque_constant =
      std::numeric_limits<double>::quiet_NaN();  // motor_torque per motor_current, N m/A; NaN: unknown
  Coupling input_coupling, output_coupling;
  bool sensor_with_damper =
      false;  // sensor_torque is spring plus damper of the input coupling, not the spring alone
  /// The load's bearing rubs, and its encoder reads, at the gear, before a flexible output coupling; else at
  /// the link. `output_coupling: bearing` of the rig file.
  bool bearing_at_gear = false;
  bool link_locked = false;
  Mesh mesh;
  std::vector<std::shared_ptr<const Term>> terms;
  /// s, by which load_position and load_velocity of a record are later than motor_position: the load encoder
  /// shows q_L(t - skew). `sensors: encoder_skew` of the rig file.
  double encoder_skew = 0;
  /// Other axes move too and are not in the record: motor_torque contains their reaction, which no model of
  /// this axis predicts. `gear_train: coupled` of the rig file.
  bool coupled = false;

  /// Factor from a load-side angle to one on the axis of motor_position (torques are divided by it):
  /// reduction ratio or 1.
  double motor_axis_ratio() const { return motor_side ? reduction_ratio : 1; }

  /// Backlash along the line of action [m] (or load-side angle [rad] for an angular mesh) to the angle on the
  /// axis of motor_position [rad].
  double backlash_angle(double backlash) const { return backlash / mesh.lever() * motor_axis_ratio(); }
};

/// Whether all members are equal; NaN equals NaN. Contact laws and terms are equal if they were made from the
/// same values. Laws that were not made by the registry, stiffness variations and tooth pairs are equal only
/// if they are the same object.
bool operator==(const Body& a, const Body& b);
bool operator==(const Coupling& a, const Coupling& b);
bool operator==(const Mesh& a, const Mesh& b);
bool operator==(const Rig& a, const Rig& b);

/// Whether the rig is a motor and a free link with a gap between them, and only the teeth are elastic.
bool has_two_inertias(const Rig& rig);

/// The same machine with all values at the load side of the reduction.
Rig load_side(const Rig& rig);

/// Reads the machine's part of a rig file (`name`, `joint`, `gear_train`, `terms`, `sensors: encoder_skew`).
/// Throws BadData naming
/// file, line, key, value and limit.
Rig read_rig(const YamlReader& yaml);

/// The rig with a backlash so large that the teeth never touch: the drive alone.
Rig without_load(Rig rig);

}  // namespace backlash::model
