// SPDX-License-Identifier: BSD-3-Clause
// The action TraceResidual.
#pragma once

#include <actionlib/server/simple_action_server.h>
#include <backlash_diagnosis/TraceResidualAction.h>
#include <ros/ros.h>

#include <functional>
#include <memory>
#include <string>

#include "backlash_diagnosis/base/file_folder.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash {
class ScratchFolder;
}

namespace backlash::ros_bridge {

class TraceServer {
 public:
  /// The rig of a joint; null with the reason in `why`.
  using FindRig = std::function<const rig_file::RigFile*(const std::string& joint, std::string& why)>;

  /// Serves `name` from then on; all paths of a goal must lie in `folder`. The work is done by the command
  /// trace_residual as a job beside the node, which may hold `memory` [GB].
  TraceServer(const ros::NodeHandle& handle, const std::string& name, FindRig find_rig, FileFolder folder,
              double memory);
  ~TraceServer();

 private:
  using Server = actionlib::SimpleActionServer<backlash_diagnosis::TraceResidualAction>;

  void execute(const backlash_diagnosis::TraceResidualGoalConstPtr& goal);
  backlash_diagnosis::TraceResidualResult trace(const backlash_diagnosis::TraceResidualGoal& goal);
  std::string rig_path(const backlash_diagnosis::TraceResidualGoal& goal, const ScratchFolder& scratch) const;

  FindRig find_rig_;
  FileFolder folder_;
  double memory_;  // GB
  std::unique_ptr<Server> server_;
};

}  // namespace backlash::ros_bridge
