// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/drive_effects.h"

#include <algorithm>

namespace backlash::geared_arm {
namespace {

/// Else it is a share of drives' torques.
bool has_law(const arm::JointEffectSpec& spec) {
  return spec.type || !spec.drive_term.empty();
}

}  // namespace

DriveEffects::DriveEffects(const arm::ArmRig& rig, std::size_t joint) {
  if (const double distance = rig.joints[joint].friction_distance; distance > 0)
    bristles_.push_back({0, distance, 0});
  for (const arm::JointEffect& effect : rig.joints[joint].effects) {
    if (!effect.other.empty()) {
      const std::vector<std::string> names = rig.joint_names();
      const auto other = std::find(names.begin(), names.end(), effect.other);
      couplings_.emplace_back(std::size_t(other - names.begin()), effect.values[0]);
    } else if (has_law(effect.spec())) {
      laws_.emplace_back(effect, effect.values);
      if (effect.spec().shape == arm::EffectShape::distance)
        bristles_.push_back(
            {effect.values[0], effect.shape, effect.given.has("damping") ? effect.given.at("damping") : 0});
    }
  }
  gain_ = 1 / (1 + recorded_more(rig.joints[joint].effects));
}

double DriveEffects::recorded_more(const std::vector<arm::JointEffect>& effects) {
  double more = 0;
  for (const arm::JointEffect& effect : effects)
    if (!has_law(effect.spec()) && effect.other.empty()) more += effect.values[0];
  return more;
}

double DriveEffects::torque(const model::JointMoment& now) const {
  double sum = 0;
  for (const auto& [law, values] : laws_) sum += values.dot(law.units(now));
  return sum;
}

}  // namespace backlash::geared_arm
