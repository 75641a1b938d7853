// SPDX-License-Identifier: BSD-3-Clause
// Records of an arm as a fit sees them: filtered without delay, with the regressor of the chain.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/record/csv.h"

namespace backlash::arm {

struct ArmRecord {
  std::string name;
  std::vector<record::Record> joints;  // in the order of the rig
  std::vector<std::string> warnings;
};

/// The joints of the rig out of a record. Throws BadData where one of them, or a channel of it, is missing:
/// motor_position and the rig's channel are needed; speeds are taken from positions where they are absent.
/// All get one time base (record/sample_joiner.h), whichever controller published them since when.
/// With load_position the links move as that says, which an elastic gear does not do with its motor.
ArmRecord arm_record(const std::vector<record::JointRecord>& joints, const ArmRig& rig,
                     const std::string& name);

/// One stretch without gaps. Rows are samples that a fit looks at, a few per cycle of the torque's low-pass;
/// "all" has every sample. Columns of matrices are joints unless said otherwise.
struct ArmMotion {
  std::string name;
  double interval = 0;       // s, between samples
  std::vector<double> time;  // s, of all samples
  Eigen::MatrixXd q, v, a;   // all, of the links, low-passed at kinematics_cutoff: rad, rad/s, rad/s^2
  Eigen::MatrixXd motor_v, motor_a;    // all, the same of the motors
  std::vector<char> link_follows;      // per joint: it has an encoder of its link, which moves as its motor's
  Eigen::MatrixXd signal;              // all, low-passed at torque_cutoff: unit of the channel
  std::vector<std::size_t> rows;       // places among all
  std::vector<Eigen::MatrixXd> chain;  // per joint: rows x 10 per link, the regressor, low-passed
  std::vector<Eigen::MatrixXd> drive;  // per joint: rows x kDriveTerms, low-passed; the load's column is 0
  Eigen::MatrixXd sign;                // all, S
  Eigen::Matrix<char, Eigen::Dynamic, Eigen::Dynamic> counts;  // rows: whether the joint moves
  Eigen::VectorXd
      noise;  // standard deviation of white noise of the signal that the low-pass leaves, per joint

  std::size_t seconds() const { return std::size_t(double(time.size()) * interval); }
};

/// The stretches between gaps; those below `kShortestStretch` are left out, which `warnings` names. Throws
/// BadData where none is left.
std::vector<ArmMotion> motions_of(const ArmRecord& record, const ArmRig& rig,
                                  std::vector<std::string>& warnings);
/// The same without what a fit looks at: `chain`, `drive` and `counts`, which are many times as large.
std::vector<ArmMotion> kinematics_of(const ArmRecord& record, const ArmRig& rig,
                                     std::vector<std::string>& warnings);
constexpr double kShortestStretch = 4;  // s; choice: some cycles of the slowest low-pass and of a motion

/// S as the rig's friction turns, and what a fit sees of it.
void set_friction_turns(ArmMotion& motion, const ArmRig& rig);

/// The part of a motion with from <= time < to.
ArmMotion part_of(const ArmMotion& motion, double from, double to);

/// How many seconds the joint moves.
double moving_seconds(const ArmMotion& motion, std::size_t joint);

}  // namespace backlash::arm
