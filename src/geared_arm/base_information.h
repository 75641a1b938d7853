// SPDX-License-Identifier: BSD-3-Clause
// How well a motion of an arm determines its base parameters, and how late the torques of its joints are
// recorded, which every fit must know as well: dtau/dt is the column of joint j's delay, in its rows.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "backlash_diagnosis/arm/dynamics.h"
#include "backlash_diagnosis/geared_arm/motion_limits.h"
#include "backlash_diagnosis/geared_arm/motion_plan.h"

namespace backlash::geared_arm {

/// Of all joints, a row per time: rad, rad/s, rad/s^2.
struct JointMotions {
  Eigen::MatrixXd q, v, a;
};

/// Y of a time: the regressor of links and drives of the rig (its terms without `load`), a row per joint.
Eigen::MatrixXd full_regressor(const arm::ArmRig& rig, const arm::Joints& q, const arm::Joints& v,
                               const arm::Joints& a);

class BaseInformation {
 public:
  /// The base parameters are those that drawn motions within the limits identify. `noise` [N m]: of each
  /// joint's torque.
  BaseInformation(const arm::ArmRig& rig, const std::vector<MotionLimits>& limits, std::vector<double> noise,
                  std::uint64_t seed);

  std::size_t parameters() const { return columns_.size(); }
  std::size_t unknowns() const { return columns_.size() + moving_.size(); }  // with the delays
  const std::vector<Eigen::Index>& columns() const { return columns_; }      // of the full regressor

  /// By every `step`-th row of a period. `torque_rate` [N m/s]: of the motors, a column per joint.
  MotionInformation of(const JointMotions& motion, const Eigen::MatrixXd& torque_rate,
                       Eigen::Index step) const;

 private:
  Eigen::MatrixXd rows_of(const JointMotions& motion, const Eigen::MatrixXd& torque_rate,
                          Eigen::Index step) const;

  const arm::ArmRig& rig_;
  std::vector<double> noise_;
  std::vector<Eigen::Index> columns_;
  std::vector<Eigen::Index> moving_;  // joints
  Eigen::VectorXd scale_;  // of these columns: their size in drawn motions, and the torque limits of moving
                           // joints [N m/s]
};

}  // namespace backlash::geared_arm
