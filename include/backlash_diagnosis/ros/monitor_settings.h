// SPDX-License-Identifier: BSD-3-Clause
// Which joints a diagnoser watches, and by what: rig files, curves, limits and baselines from its parameters.
#pragma once

#include <vector>

#include "backlash_diagnosis/ros/joint_monitor.h"
#include "backlash_diagnosis/ros/parameters.h"

namespace backlash::ros_bridge {

/// Reads ~rig or ~rig_folder, ~joints, and the parameters of each joint; `defaults` has the settings that all
/// joints share. Throws InvalidParameter, BadData, MissingInput.
std::vector<MonitorSettings> load_monitors(Parameters& parameters, const MonitorSettings& defaults);

}  // namespace backlash::ros_bridge
