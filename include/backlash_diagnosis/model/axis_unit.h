// SPDX-License-Identifier: BSD-3-Clause
// Units of a linear axis, where registries name those of a rotary one.
#pragma once

#include <string>

namespace backlash::model {

/// "N m s/rad" of a rotary axis is "N s/m" of a linear one, "kg m^2" is "kg", "rad" is "m". Unchanged unless
/// `linear`.
std::string axis_unit(const std::string& rotary, bool linear);

}  // namespace backlash::model
