// SPDX-License-Identifier: BSD-3-Clause
// The arm in time: all joints in one integrator, a motor torque per joint by its excitation.
#pragma once

#include <memory>
#include <vector>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/geared_arm/drive_effects.h"
#include "backlash_diagnosis/geared_arm/geared_arm.h"

namespace backlash::geared_arm {

class ArmPlant {
 public:
  /// At rest at time 0: every joint at its start or where it is held, every motor in the middle of its gap.
  explicit ArmPlant(const GearedArm& arm);
  ArmPlant(const ArmPlant&) = delete;  // the integrator calls it back
  ArmPlant& operator=(const ArmPlant&) = delete;

  double time() const { return time_; }
  /// Throws IntegrationError.
  void advance_to(double t);

  /// What exact sensors would show of a joint now; sensor_torque is NaN, output_torque that of the mesh.
  model::Observation observe(std::size_t joint) const;

  /// Total play [rad] of a joint; 0 of one without gear and of one that is held.
  double backlash(std::size_t joint) const;
  /// From now on. Throws InvalidParameter unless >= 0 and finite, and for a joint that has no gap.
  void set_backlash(std::size_t joint, double backlash);
  /// Links, payloads, drives, gears and gravity of another file from now on, in the same motion: excitations,
  /// sensors and what gravity compensation believes stay. Throws InvalidParameter where a joint has another
  /// name, or a gear, a rotor or a hold that it did not have.
  void set_machine(const GearedArm& arm);
  /// Motor torque [N m] from now on of a joint with `topic` excitation, false of all others. Gravity
  /// compensation, which is added, is renewed. Throws InvalidParameter unless finite.
  bool set_torque(std::size_t joint, double torque);

  /// Kinetic, potential and elastic energy of all parts [J].
  double energy() const;

  /// Sets position and speed of the links and of the motors (those of joints without gear do not count).
  void set_state(const arm::Joints& q, const arm::Joints& v, const arm::Joints& motor_q,
                 const arm::Joints& motor_v);
  arm::Joints link_positions() const;
  simulation::IntegratorStatistics statistics() const { return integrator_->statistics(); }

 private:
  struct Drive {
    std::unique_ptr<simulation::Excitation> excitation;  // null: held
    long segment = 0;
    double compensation = 0;  // N m, of gravity
    Eigen::Index motor = -1;  // place among the angles; -1: turns with the link
    DriveEffects effects;
    std::size_t bristles = 0;  // place of their first state
  };
  void begin_segments();
  void compensate_gravity();
  void derivative(double t, const double* state, double* rate) const;
  double mesh_torque(std::size_t joint, const double* state) const;
  double motor_friction(std::size_t joint, const double* state, double load) const;
  void bristle_rates(std::size_t joint, const double* state, double* rate) const;
  /// Place of the angle that the motor turns by; its speed is `angles_` farther.
  std::size_t motor_angle(std::size_t joint) const;
  double acting_torque(std::size_t joint, double t) const;
  double motor_torque(std::size_t joint, double t) const;
  arm::Joints motor_positions() const;

  GearedArm arm_;
  arm::Chain chain_, believed_;  // believed_: by gravity compensation
  std::vector<Drive> drives_;
  Eigen::Index links_, angles_;
  arm::Joints rotors_, given_;  // of joints without gear; 0 where held, NaN elsewhere
  std::vector<double> state_;   // angles of links, of motors; their speeds; bristles of all joints
  double time_ = 0;
  bool begun_ = false;
  std::unique_ptr<simulation::Integrator> integrator_;
};

}  // namespace backlash::geared_arm
