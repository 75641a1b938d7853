// SPDX-License-Identifier: BSD-3-Clause
// The term that describes a weight off a joint's axis, for those who look for it among the terms of a rig.
#pragma once

#include <string>

namespace backlash::model {

/// Id of the term whose load torque is -amplitude sin(q + phase): amplitude [N m], phase [rad].
const std::string& weight_term();

}  // namespace backlash::model
