// SPDX-License-Identifier: BSD-3-Clause
// Which of the servo's parameters are friction.
#pragma once

#include <string>

#include "backlash_diagnosis/model/rig.h"

namespace backlash {

/// Coulomb or viscous friction, or the difference of either between the directions.
bool is_friction(const std::string& parameter);
/// Such a difference.
bool is_asymmetry(const std::string& parameter);
/// The name of the difference that belongs to a friction.
std::string asymmetry_of(const std::string& friction);
/// Its value [unit of the friction]; 0 where it has none.
double asymmetry(const std::string& friction, const Rig& rig);

}  // namespace backlash
