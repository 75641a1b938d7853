// SPDX-License-Identifier: BSD-3-Clause
// The term that a weight off a joint's axis is: how what identifies one finds it.
#pragma once

#include <string>

namespace backlash::model {

/// Id of the term whose load torque is -amplitude sin(q + phase): amplitude [N m], phase [rad].
const std::string& weight_term();

}  // namespace backlash::model
