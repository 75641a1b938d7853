// SPDX-License-Identifier: BSD-3-Clause
// What a rig file says of a joint, reduced to what simulators of rigid bodies know.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::report {

struct JointBody {
  double inertia;  // kg m^2 (linear axis: kg; as all units here)
  double viscous;  // N m s/rad
  double coulomb;  // N m
};

/// A torque -amplitude sin(q + phase) on the last body.
struct JointGravity {
  double amplitude, phase;  // N m, rad
};

/// All at the load side of the reduction.
struct JointModel {
  std::string name;
  bool linear = false;
  double ratio = 1;        // motor turns per load turn
  double torque_gear = 1;  // torque here over motor_torque of a record
  JointBody motor{};       // of one inertia: all of it
  std::optional<JointBody> load;
  double backward = 0, forward = 0;   // rad, q_motor - q_load at which the flanks touch, <= 0 and >= 0
  double stiffness = 0, damping = 0;  // N m/rad, N m s/rad, of the teeth
  std::optional<JointGravity> gravity;
  std::vector<std::string> unsaid;

  const JointBody& last() const { return load ? *load : motor; }
  double reduced_inertia() const { return 1 / (1 / motor.inertia + 1 / load->inertia); }
};

/// Throws as simulator_model().
JointModel joint_model(const rig_file::RigFile& file, std::optional<double> torque);

}  // namespace backlash::report
