// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/node_folders.h"

#include <cstdlib>
#include <filesystem>

#include "backlash_diagnosis/base/error.h"

namespace backlash::ros_bridge {

std::string read_history_folder(Parameters& parameters) {
  const std::string folder = parameters.text("history", "");
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw InvalidParameter("~history", folder, "must be a folder that exists");
  return folder;
}

std::string default_folder() {
  if (const char* ros_home = std::getenv("ROS_HOME")) return std::string(ros_home) + "/backlash_diagnosis";
  const char* home = std::getenv("HOME");
  return std::string(home ? home : ".") + "/.ros/backlash_diagnosis";
}

}  // namespace backlash::ros_bridge
