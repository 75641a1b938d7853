// SPDX-License-Identifier: BSD-3-Clause
// A folder with a rig file for each joint of a robot.
#pragma once

#include <map>
#include <string>

#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::ros_bridge {

/// All *.yaml of a folder, by the joint that each names. Throws InvalidParameter naming ~rig_folder: no
/// folder, no rig file in it, two of one joint; BadData of a file.
std::map<std::string, rig_file::RigFile> load_rig_folder(const std::string& folder);

}  // namespace backlash::ros_bridge
