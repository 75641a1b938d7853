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

class TraceServer {
 public:
  /// The rig of a joint; null with the reason in `why`.
  using FindRig = std::function<const RigFile*(const std::string& joint, std::string& why)>;

  /// Serves `name` from then on, in a thread of its own; all paths of a goal must lie in `folder`.
  TraceServer(const ros::NodeHandle& handle, const std::string& name, FindRig find_rig, FileFolder folder);
  ~TraceServer();

 private:
  using Server = actionlib::SimpleActionServer<backlash_diagnosis::TraceResidualAction>;

  void execute(const backlash_diagnosis::TraceResidualGoalConstPtr& goal);
  backlash_diagnosis::TraceResidualResult trace(const backlash_diagnosis::TraceResidualGoal& goal);

  FindRig find_rig_;
  FileFolder folder_;
  std::unique_ptr<Server> server_;
};

}  // namespace backlash
