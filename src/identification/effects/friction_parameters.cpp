// SPDX-License-Identifier: BSD-3-Clause
#include "friction_parameters.h"

#include "backlash_diagnosis/rig_file/rig_parameters.h"

namespace backlash {

bool is_friction(const std::string& parameter) {
  return parameter.find("viscous") != std::string::npos || parameter.find("coulomb") != std::string::npos;
}

bool is_asymmetry(const std::string& parameter) {
  return parameter.find("_asymmetry") != std::string::npos;
}

std::string asymmetry_of(const std::string& friction) {
  return friction + "_asymmetry";
}

double asymmetry(const std::string& friction, const Rig& rig) {
  for (const RigParameter& p : servo_parameters())
    if (p.name == asymmetry_of(friction)) return p.get(rig);
  return 0;
}

}  // namespace backlash
