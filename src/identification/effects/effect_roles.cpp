// SPDX-License-Identifier: BSD-3-Clause
#include "effect_roles.h"

#include "backlash_diagnosis/model/term.h"

namespace backlash::identification {

bool is_learned(const std::string& id) {
  return model::term_type(id).map.has_value();
}

bool is_delay(const std::string& id) {
  return model::term_type(id).calibrates == model::Calibrates::torque_delay;
}

bool stands_in_for_contact_law(const std::string& id) {
  return model::term_type(id).stands_in_for_contact_law;
}

bool shapes_friction(const std::string& id) {
  return model::term_type(id).shapes_friction;
}

}  // namespace backlash::identification
