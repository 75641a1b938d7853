// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/rig_folder.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "backlash_diagnosis/base/error.h"

namespace backlash::ros_bridge {

std::map<std::string, rig_file::RigFile> load_rig_folder(const std::string& folder) {
  if (!std::filesystem::is_directory(folder))
    throw InvalidParameter("~rig_folder", folder, "must be a folder that exists");
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".yaml") paths.push_back(entry.path().string());
  std::sort(paths.begin(), paths.end());
  std::map<std::string, rig_file::RigFile> rigs;
  for (const std::string& path : paths) {
    rig_file::RigFile rig = rig_file::load_rig_file(path);
    const std::string joint = rig.rig.joint;
    if (!rigs.emplace(joint, std::move(rig)).second)
      throw InvalidParameter("~rig_folder", path, "is the second rig file there of joint '" + joint + "'");
  }
  if (rigs.empty()) throw InvalidParameter("~rig_folder", folder, "has no rig file (*.yaml)");
  return rigs;
}

}  // namespace backlash::ros_bridge
