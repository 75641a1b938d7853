// SPDX-License-Identifier: BSD-3-Clause
// Effects of a joint that its rig file has beside the terms of the drive (joint_effect.h), in a simulation.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "backlash_diagnosis/arm/arm_rig.h"

namespace backlash::geared_arm {

class DriveEffects {
 public:
  /// None.
  DriveEffects() = default;
  DriveEffects(const arm::ArmRig& rig, std::size_t joint);

  /// Recorded torque of the motor over the torque that it gives, less 1, by all gains together.
  static double recorded_more(const std::vector<arm::JointEffect>& effects);

  /// What the drive has to supply for them [N m], without gain and couplings.
  double torque(const model::JointMoment& now) const;
  /// The motor's torque over what is recorded of it.
  double gain() const { return gain_; }
  /// Other joints, and the share of their drives' torque that this one has to supply.
  const std::vector<std::pair<std::size_t, double>>& couplings() const { return couplings_; }

 private:
  std::vector<std::pair<arm::EffectLaw, Eigen::Vector2d>>
      momentary_;  // those without a memory, and their values
  std::vector<std::pair<std::size_t, double>> couplings_;
  double gain_ = 1;
};

}  // namespace backlash::geared_arm
