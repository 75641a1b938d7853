// SPDX-License-Identifier: BSD-3-Clause
// What a motion of an arm tells of its base parameters.
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
  /// The base parameters are what drawn motions within the limits tell apart. `noise` [N m]: of each joint's
  /// torque.
  BaseInformation(const arm::ArmRig& rig, const std::vector<MotionLimits>& limits, std::vector<double> noise,
                  std::uint64_t seed);

  std::size_t parameters() const { return columns_.size(); }
  const std::vector<Eigen::Index>& columns() const { return columns_; }  // of the full regressor

  /// By every `step`-th row.
  MotionInformation of(const JointMotions& motion, Eigen::Index step) const;

 private:
  const arm::ArmRig& rig_;
  std::vector<double> noise_;
  std::vector<Eigen::Index> columns_;
  Eigen::VectorXd scale_;  // of these columns: their size in drawn motions
};

}  // namespace backlash::geared_arm
