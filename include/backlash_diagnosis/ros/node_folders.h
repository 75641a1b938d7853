// SPDX-License-Identifier: BSD-3-Clause
// Folders in which nodes keep files.
#pragma once

#include <string>

#include "backlash_diagnosis/ros/parameters.h"

namespace backlash::ros_bridge {

/// backlash_diagnosis in ROS_HOME (~/.ros).
std::string default_folder();

/// ~history; empty: none is kept. Throws InvalidParameter for a folder that does not exist.
std::string read_history_folder(Parameters& parameters);

}  // namespace backlash::ros_bridge
