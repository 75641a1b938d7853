// SPDX-License-Identifier: BSD-3-Clause
// Option --hold: joints of a URDF that stand still.
#pragma once

#include <map>
#include <string>

#include "tools/common/command_line.h"

namespace backlash::tools {

Option hold_option();

/// JOINT or JOINT=POSITION [rad; m of a prismatic one]; no joint's name holds a '='. Throws UsageError.
std::map<std::string, double> held_joints(const Arguments& arguments);

}  // namespace backlash::tools
