// SPDX-License-Identifier: BSD-3-Clause
// What the main functions of the nodes share.
#pragma once

#include <functional>
#include <string>

namespace backlash::ros_bridge {

/// Runs a node and returns its exit code. `--help` prints `help` without a roscore; any other argument that
/// is neither a remapping nor a parameter is refused with 64. An exception of `run` becomes one ROS_FATAL
/// line and 64 (InvalidParameter), 65 (BadData), 66 (MissingInput) or 70 (all others).
int node_main(int argc, char** argv, const std::string& name, const char* help,
              const std::function<int()>& run);

/// The nodes. They are not in their mains, as what they include takes seconds to compile. The last is in
/// ros_arm.
int simulator_main(int argc, char** argv);
int diagnoser_main(int argc, char** argv);
int exciter_main(int argc, char** argv);
int change_watch_main(int argc, char** argv);

}  // namespace backlash::ros_bridge
