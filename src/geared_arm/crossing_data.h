// SPDX-License-Identifier: BSD-3-Clause
// Stretches of a record in which the load on the teeth of a joint turns, with what the motors did there and
// what the chain is there. They begin where the chain's load holds the teeth of every joint on a flank for
// certain. Equations: geared_arm/traverse.h.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/motion.h"
#include "backlash_diagnosis/geared_arm/geared_arm.h"
#include "backlash_diagnosis/geared_arm/traverse.h"

namespace backlash::geared_arm {

/// What is declared of a joint's teeth and drive, all at the joint.
struct TraverseJoint {
  std::size_t joint = 0;              // of the rig
  double stiffness = 0, damping = 0;  // N m/rad, N m s/rad, at `level`
  double level = 0;                   // N m, the usual load of its teeth
  double most = 0, lesser = 0;        // N m, the largest load, and that on the flank which is loaded less
  double rotor = 0;                   // kg m^2
  double least_inertia = 0;           // kg m^2, of what the link moves, at the poses of the record
  double link_coulomb = 0, link_viscous = 0;
  double coulomb = 0;         // N m, of the motor
  double slow_torque = 0;     // N m, standard deviation of what neither chain nor drive explains
  double torque_noise = 0;    // N m, white, of a sample
  double position_noise = 0;  // rad, the same
  bool crosses = false;       // the load is certain on both flanks
};

/// Columns are the joints that have a gap to look for, rows are samples.
struct CrossingWindow {
  double begin = 0;                      // s
  Eigen::MatrixXd position, rate;        // of the motors, smoothed over a few samples: rad, rad/s
  Eigen::MatrixXd torque, friction;      // N m, of the motors
  Eigen::MatrixXd unsure;                // N m, of the friction: standard deviation about a standstill
  Eigen::MatrixXd bias;                  // N m: the chain's torque but for its own acceleration
  std::vector<Eigen::MatrixXd> inertia;  // kg m^2, of these joints
  Eigen::VectorXd load;                  // N m, through the teeth at the first sample
  Eigen::MatrixXd chain;                 // N m, T of the motors' motion, low-passed
  Eigen::MatrixXd pose;                  // rad, of the motors of all joints of the rig
  Eigen::Index samples() const { return position.rows(); }
};

struct CrossingData {
  double interval = 0;        // s
  double friction_speed = 0;  // rad/s
  int steps = 1;              // of the integration per sample
  Eigen::Index reach = 2;     // samples to each side that a position is smoothed over
  Eigen::Index block = 5;     // samples whose torques are averaged
  Eigen::Index skipped = 0;   // samples after the begin of a window that do not count
  std::vector<TraverseJoint> joints;
  std::vector<CrossingWindow> windows;
  std::size_t turns = 0;  // of the load of any joint, of which windows are a part
};

/// Of the teeth between what they move [s]: the motor's rotor and the link.
double teeth_cycle(const TraverseJoint& joint);

/// All joints of the rig that are not among `joints` turn with their motors.
CrossingData crossing_data(const GearedArm& arm, const arm::ArmRig& fitted, const arm::ArmRecord& record,
                           const std::vector<arm::ArmMotion>& motions,
                           const std::vector<TraverseJoint>& joints, const TraverseSettings& settings);

}  // namespace backlash::geared_arm
