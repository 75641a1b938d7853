// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/drive_effects.h"

#include <algorithm>

namespace backlash::geared_arm {

DriveEffects::DriveEffects(const arm::ArmRig& rig, std::size_t joint) {
  for (const arm::JointEffect& effect : rig.joints[joint].effects) {
    if (const auto units = effect.spec().units) {
      momentary_.push_back({units, effect.shape, effect.values});
    } else if (!effect.other.empty()) {
      const std::vector<std::string> names = rig.joint_names();
      const auto other = std::find(names.begin(), names.end(), effect.other);
      couplings_.emplace_back(std::size_t(other - names.begin()), effect.values[0]);
    }
  }
  gain_ = 1 / (1 + recorded_more(rig.joints[joint].effects));
}

double DriveEffects::recorded_more(const std::vector<arm::JointEffect>& effects) {
  double more = 0;
  for (const arm::JointEffect& effect : effects)
    if (!effect.spec().units && !effect.spec().has_shape() && effect.other.empty()) more += effect.values[0];
  return more;
}

double DriveEffects::torque(const arm::DriveMoment& now) const {
  double sum = 0;
  for (const Momentary& m : momentary_) sum += m.values.dot(m.units(m.shape, now));
  return sum;
}

}  // namespace backlash::geared_arm
