// SPDX-License-Identifier: BSD-3-Clause
// Equations of motion of one gear train, in absolute angles at the load side of the reduction.
//
//   J_M a_M = tau_M - c_M w_M - F_M - T_I      T_I = k_I (q_M - q_P) + c_I (w_M - w_P)
//   J_P a_P = T_I - c_P w_P - r F              x   = r (q_P - q_G) + start, contact where |x| > backlash / 2
//   J_G a_G = r F - c_G w_G - T_O              F   = contact law, sign of x, times variation if any; of
//                                                    pairs of teeth see tooth_pairs.h
//   J_L a_L = T_O - c_L w_L - F_L + terms      T_O = k_O (q_G - q_L) + c_O (w_G - w_L)
//
// Positive q_G is the direction in which a positive q_P drives the gear. A rigid coupling makes its
// neighbours one body, so does a rigid mesh; a locked link has q_L = 0. F_M and F_L are dry friction with
// sticking, see StickSlip; F_L acts on the gear where the bearing is there (Rig::bearing_at_gear); a braked
// motor sticks whatever the torque. Terms may shift either flank by an opening o(q_M, q_L, torque). Its
// penetration is then side x - backlash / 2 - r o, and the mesh torque acts on both ends also through the
// slopes of o. This conserves energy unless o depends on the torque.
//
// If mesh and couplings are rigid, the teeth do not appear in the equations. Terms that depend on the torque
// through the teeth then get the torque that the load takes,
//   T = J a - terms on the load        J of gear and link; of the whole body if they have none in the file
// without dry friction of the load. Friction may depend on it (T and friction are solved for together),
// smooth torques may not. After Sarkar, Ellis and Moore (1997), Eqs. 1 to 5 and Table 1, with absolute
// instead of relative coordinates.
#pragma once

#include <array>
#include <optional>

#include "backlash_diagnosis/model/equations_of_motion.h"
#include "backlash_diagnosis/model/rig.h"
#include "backlash_diagnosis/model/stick_slip.h"

namespace backlash::model {

/// Torques from outside at one moment [N m]: of the motor in the units of the rig's records, on the load.
struct AppliedTorque {
  AppliedTorque(double motor_torque = 0, double load_torque = 0) : motor(motor_torque), load(load_torque) {}
  double motor, load;
};

/// What sensors would show of a gear train at one moment, in the units of its records (see Rig::motor_side).
struct Observation {
  double motor_torque, motor_position, motor_velocity;
  // N m, of the input coupling: its spring (an ideal strain gauge), or spring and damper (T_I) where the rig
  // says so; NaN if rigid
  double sensor_torque;
  double sensor_twist, sensor_twist_rate;  // rad, rad/s, twist of the input coupling; NaN if rigid
  double load_position, load_velocity;     // with the scale error of the load encoder (Sensing)
  double output_torque;  // N m, at the load, spring torque of the output coupling; NaN if rigid
  double
      motor_current;  // A, motor_torque / torque constant: an ideal current control; NaN without the constant
  double acceleration;  // rad/s^2, of the gear; of the pinion (as motor_position) where the gear cannot move
};

class GearTrain : private TrainParts {
 public:
  /// Throws InvalidParameter for a massless part, no contact law, a backlash < 0, or pairs of teeth whose law
  /// needs the speed of a touch.
  explicit GearTrain(const Rig& rig);

  /// Degrees of freedom, 1 to 4. A state has 2 * dof numbers: first the angles [rad], then the speeds
  /// [rad/s].
  int dof() const { return layout_.dof; }
  static constexpr int kMaxStates = 8;

  /// dstate/dt at time t [s].
  void derivative(double t, const double* state, AppliedTorque applied, double* rate) const;

  /// `t` [s] matters only to terms that depend on time.
  Observation observe(const double* state, AppliedTorque applied, double t = 0) const;

  /// Torques on the two ends, without their dry friction.
  struct EndForces {
    double motor, load;    // N m, sum of all other torques
    double mesh_torque;    // N m, through the teeth, > 0 drives the load forward
    EndFriction friction;  // where both ends are one body, all of it at the motor
  };
  EndForces end_forces(double t, const double* state, AppliedTorque applied) const;
  /// Torques on the load while the motor moves as recorded. For a train with rigid couplings and an elastic
  /// mesh; of the terms only those that move the load. The mesh torque in `motion` is not read.
  struct LoadForces {
    double net;            // N m on the link, without dry friction
    double mesh_torque;    // N m, through the teeth, > 0 drives the load forward
    double mesh_on_motor;  // N m, of the teeth; -mesh_torque unless terms shift the flanks
    FrictionLimits friction;
  };
  LoadForces load_forces(const Motion& motion) const;
  /// Whether load_forces() consists of dampers, teeth whose force depends on penetration and rate alone, and
  /// constant friction. Then equations() with power_contact() and the friction limits of any moment say all
  /// of it.
  bool plain_load() const {
    return power_contact() && !contact_->needs_impact_speed() && !variation_ && !pairs_ && !shaped_ &&
           load_terms_.empty();
  }

  /// The shift of either flank at these positions, forward flank first; infinite for a flank that is too far
  /// away to touch. Saves time if forces are computed several times at nearly the same position. Only if
  /// flanks_shift_with_position().
  using Flanks = std::array<FlankShift, 2>;
  bool flanks_shift_with_position() const { return shaped_ && !shape_follows_torque_; }
  Flanks flanks(double motor_position, double load_position) const;
  LoadForces load_forces(const Motion& motion, const Flanks& flanks) const;

  /// N m: the torque T above that the load takes at this acceleration [rad/s^2], of a rigid train.
  double torque_of_load(const Motion& motion, double acceleration) const;

  /// Torques on the motor other than mesh and motor torque, with rigid couplings; on motor and link together
  /// if they are one body.
  struct MotorForces {
    double net;  // N m, without dry friction
    FrictionLimits friction;
  };
  MotorForces motor_forces(const Motion& motion) const;
  /// kg m^2 of all that moves with the motor and with the link (infinite where it is fixed); load-side.
  double motor_inertia() const { return inertia_[layout_.node[kMotor]]; }
  double load_inertia() const;

  /// Whether nothing acts but springs, dampers and teeth without memory: equations() with the force of the
  /// contact law is then the whole model.
  bool smooth() const { return smooth_; }
  const EquationsOfMotion<double>& equations() const { return equations_; }
  std::optional<PowerContact> power_contact() const {
    return contact_ ? contact_->power_contact() : std::nullopt;
  }
  const TrainLayout& layout() const { return layout_; }
  double ratio() const { return ratio_; }  // load-side torque per torque of the records

  /// Kinetic plus elastic energy (couplings, contact) [J]. Not included: terms, flanks that shift under their
  /// torque, and forces that a term adds to the contact law.
  double energy(const double* state) const;

  /// Power dissipated by the dampers of motor, couplings and link [W], without that of contact damping.
  double damping_power(const double* state) const;

  /// Twist between motor and link (gear, if the load is shown there) under a static torque with one flank
  /// pressed, without the gap. Torque and
  /// angle in the units of motor_torque and motor_position; odd in torque. With the mean stiffness of the
  /// mesh cycle.
  double elastic_deflection(double motor_torque) const;

  /// Total free play [m] (angular mesh: [rad] at the load side), >= 0; takes effect at the next derivative().
  void set_backlash(double backlash);
  double backlash() const { return 2 * half_gap_; }

  /// A contact law may depend on the speed at which a contact began (ContactLaw::needs_impact_speed). Then
  /// the caller reports touches: begin_contact() after the state was set, and update_contact() each time one
  /// of the kContactEvents values rises through 0. Between touches the teeth have no force, so that the
  /// motion is smooth up to the next touch. Without these calls every contact has begun at speed 0.
  bool needs_touches() const { return contact_ && contact_->needs_impact_speed(); }
  static constexpr int kContactEvents = 4;
  void contact_events(const double* state, double* values) const;
  /// Forgets the last touch. A flank at its surface (to rounding) that approaches is a touch; one that
  /// already penetrates is in contact with impact speed 0.
  void begin_contact(double* state);
  /// Keeps the approach speed of a touch; the speeds in `state` jump if the law says so. True if integration
  /// must start again because derivative or state have changed.
  bool update_contact(double* state);
  double impact_speed() const { return impact_speed_; }  // m/s at the last touch, 0 if there was none

  /// Dry friction: the caller also reports where a body begins to stick or to slide. begin_friction() after
  /// the state was set (it forgets where bodies turned last); update_friction() each time the torque jumps or
  /// one of the friction_event_count() values rises through 0. If it returns true, integration must start
  /// again.
  int friction_event_count() const { return static_cast<int>(dry_ends_.size()); }
  void friction_events(double t, const double* state, AppliedTorque applied, double* values) const;
  void begin_friction(double t, double* state, AppliedTorque applied);
  bool update_friction(double t, double* state, AppliedTorque applied);
  /// 1 / w [s] of the fastest oscillation w [rad/s] of a body on the spring of presliding friction; infinite
  /// if none moves. Longer steps would miss reversals of motions smaller than the solver's tolerance.
  double presliding_time(double t, const double* state, AppliedTorque applied) const;
  /// Puts each body that sticks back to where it came to rest, as a solver's interpolation moves it by
  /// rounding errors.
  void hold(double* state) const;
  bool any_stuck() const;
  /// Holds the motor from now on; before begin_friction().
  void brake_motor();

 private:
  using PartMotion = EquationsOfMotion<double>::PartMotion;

  /// A flank pair: +1 touches where the pinion drives forward, -1 where it drives back.
  enum Flank { kReverse = -1, kApart = 0, kForward = 1 };

  /// All torques of one moment, per degree of freedom, and what they are made of.
  struct Balance {
    double net[kPartCount];  // N m, without dry friction
    double mesh_torque;
    EndFriction friction;
  };
  struct DryEnd {
    int part;  // kMotor, kLink or kGear
    StickSlip mode;
    double position = 0;  // rad, where it sticks
  };

  bool moves(int part) const { return layout_.node[part] != TrainLayout::kFixed; }
  bool one_body() const { return layout_.node[kLink] == layout_.node[kMotor]; }
  PartMotion part_motion(const double* state) const { return equations_.part_motion(layout_, state); }
  Motion motion_of(double t, const PartMotion& s, double mesh_torque) const {
    return {t, s.q[kMotor], s.w[kMotor], s.q[load_end_], s.w[load_end_], mesh_torque};
  }
  double add_teeth(const PartMotion& s, double* torque) const;
  double net_torques(double t, const PartMotion& s, AppliedTorque applied, double* net) const;
  Balance balance(double t, const double* state, AppliedTorque applied) const;
  double gap_position(const PartMotion& s) const { return equations_.gap_position(s, half_gap_); }
  FlankPoint flank_point(const PartMotion& s, int side, double mesh_torque) const;
  FlankShift shift(const PartMotion& s, int side, double mesh_torque) const;
  FlankShift shift_within_reach(const PartMotion& s, int side) const;
  double flank_force(const PartMotion& s, int side, double penetration, double rate,
                     double mesh_torque) const;
  double add_shaped_teeth(const PartMotion& s, double* torque) const;
  double shaped_force(const PartMotion& s, int side, FlankShift& at) const;
  double shifted_force(const PartMotion& s, int side, const FlankShift& at, double mesh_torque) const;
  ToothPairs::Place place_of(const PartMotion& s, int side, double penetration, double rate) const;
  void press(const PartMotion& s, int side, const FlankShift& at, double flank_torque, double* torque) const;
  static void press(int side, const FlankShift& at, double flank_torque, double* torque);
  static PartMotion ends(const Motion& motion);
  template <typename AddTeeth>
  LoadForces load_forces(const Motion& motion, const PartMotion& s, const AddTeeth& add_teeth) const;
  EndFriction friction(const Motion& motion) const;
  EndFriction friction_under(const Motion& motion, const double* net) const;
  void check_what_follows_torque() const;
  const FrictionLimits& limits(const DryEnd& end, const EndFriction& friction) const;
  double penetration(const PartMotion& s, Flank flank) const;
  double approach(const PartMotion& s, Flank flank) const;
  void enter(Flank flank);
  void touch(Flank flank, double* state);
  double force_at(double x, double rate) const;
  double contact_force(const PartMotion& s) const;
  void sum_inertia(const Rig& rig);

  double ratio_;  // load-side torque per torque of the records: Rig::motor_axis_ratio()
  TrainLayout layout_;
  EquationsOfMotion<double> equations_;
  std::array<double, kPartCount> inertia_{};  // per degree of freedom, kg m^2
  double share_of_load_ = 1;                  // of the inertia of one body
  double sensed_damping_;  // N m s/rad, the part of the sensor's damper that sensor_torque shows
  double half_gap_, lever_;
  EndFriction coulomb_;
  int load_end_;  // the part of the load that rubs and is shown: kLink, or kGear (Rig::bearing_at_gear)
  bool shaped_ = false, shape_follows_torque_ = false, loaded_ = false;
  bool friction_of_load_ = false;  // of one body, follows what its load takes
  bool braked_ = false;
  bool smooth_;
  bool presliding_ = false;  // either end has a presliding distance, which does not change
  std::vector<DryEnd> dry_ends_;
  double impact_speed_ = 0;  // m/s, approach speed at the last touch
  double acting_gap_;        // where the force begins: half_gap_, or infinite between touches
  Flank flank_ = kApart;     // in contact, for a law that needs touches
  double torque_constant_;   // N m/A, NaN if unknown
  std::shared_ptr<const ContactLaw> contact_;
  std::shared_ptr<const StiffnessVariation> variation_;
  std::shared_ptr<const ToothPairs> pairs_;
  double protrusion_ = 0;  // m, of the pairs
  std::vector<std::shared_ptr<const Term>> terms_;
  std::vector<const Term*> flank_terms_, load_terms_;  // of terms_, that shape flanks and that push the load
  double load_gain_;                                   // -, of the load encoder
};

}  // namespace backlash::model
