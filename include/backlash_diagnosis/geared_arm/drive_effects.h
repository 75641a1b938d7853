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

  /// What the drive has to supply for them [N m], without gain and couplings. Bristles by `now.way`; where
  /// that is infinite they have the direction of `now`.
  double torque(const model::JointMoment& now) const;
  /// The motor's torque over what is recorded of it.
  double gain() const { return gain_; }
  /// Friction `torque` [N m] that builds up over `distance` x_s [rad] (Dahl, model/presliding.h): its share z
  /// acts, x_s dz/dt = v - |v| z, where of all other dry friction the share S acts.
  struct Bristles {
    double torque = 0, distance = 0, damping = 0;  // damping [N m s/rad] of x_s dz/dt more, LuGre
  };
  /// With a `friction_distance` of the joint the first has no torque of its own: its z is that of S.
  const std::vector<Bristles>& bristles() const { return bristles_; }
  /// Other joints, and the share of their drives' torque that this one has to supply.
  const std::vector<std::pair<std::size_t, double>>& couplings() const { return couplings_; }

 private:
  std::vector<std::pair<arm::EffectLaw, Eigen::Vector2d>> laws_;  // and their values
  std::vector<Bristles> bristles_;
  std::vector<std::pair<std::size_t, double>> couplings_;
  double gain_ = 1;
};

}  // namespace backlash::geared_arm
