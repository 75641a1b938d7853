// SPDX-License-Identifier: BSD-3-Clause
// Whether the loads along a motion would show the gaps of an arm's joints to the diagnosis of
// geared_arm/play.h: enough stays on both flanks, and a load that the motor's torque can confirm.
#pragma once

#include <array>
#include <vector>

#include "motion_loads.h"

namespace backlash::geared_arm {

class GapViews {
 public:
  /// `noise` [N m]: of each motor's torque; 0 where it is not known.
  GapViews(const GearedArm& arm, const arm::Chain& chain, const std::vector<MotionLimits>& limits,
           const PlanSettings& settings, std::vector<double> noise);

  bool has_gap(std::size_t joint) const { return has_gap_[joint] != 0; }
  /// Whether some motion may show it, as far as was searched.
  bool possible(std::size_t joint) const { return has_gap(joint) && obstacles(joint).empty(); }

  /// Of the torques of a period, a value per `interval` [s]: 0 where the gap is shown, margin and all; else
  /// how much is missing, smoothly.
  double lacking(std::size_t joint, const MotionTorques& torques, double interval) const;

  /// Fills in what JointPlan says of the gap. `torques`: of a period, as often as the diagnosis looks.
  void describe(JointPlan& plan, std::size_t joint, const arm::Joints& offsets,
                const MotionTorques& torques) const;

  /// Time between two rows of the diagnosis [s].
  double row_interval() const;

 private:
  std::vector<std::string> obstacles(std::size_t joint) const;
  bool knows_drive(std::size_t joint) const;
  double least_reach(std::size_t joint) const;
  double unconfirmed(std::size_t joint, double own) const;

  const GearedArm& arm_;
  const arm::Chain& chain_;
  const std::vector<MotionLimits>& limits_;
  const PlanSettings& settings_;
  std::vector<double> noise_;
  std::vector<JointLoad> friction_;
  std::vector<char> has_gap_;
  std::vector<std::array<double, 2>> reach_;  // as reachable_loads() has it
  double hold_;                               // s: how long a load must stay on a flank to count
};

}  // namespace backlash::geared_arm
