// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/geared_arm/drive_effects.h"

#include <algorithm>

namespace backlash::geared_arm {

DriveEffects::DriveEffects(const arm::ArmRig& rig, std::size_t joint) {
  double more = 0;  // that is recorded, as a share
  for (const arm::JointEffect& effect : rig.joints[joint].effects) {
    if (const auto units = effect.spec().units) {
      momentary_.push_back({units, effect.shape, effect.values});
    } else if (effect.other.empty()) {
      more += effect.values[0];
    } else {
      const std::vector<std::string> names = rig.joint_names();
      const auto other = std::find(names.begin(), names.end(), effect.other);
      couplings_.emplace_back(std::size_t(other - names.begin()), effect.values[0]);
    }
  }
  gain_ = 1 / (1 + more);
}

double DriveEffects::torque(const arm::DriveMoment& now) const {
  double sum = 0;
  for (const Momentary& m : momentary_) sum += m.values.dot(m.units(m.shape, now));
  return sum;
}

}  // namespace backlash::geared_arm
