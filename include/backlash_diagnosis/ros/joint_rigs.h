// SPDX-License-Identifier: BSD-3-Clause
// Which joints a node watches, and by which rig files: ~rig, ~rig_folder, ~joints, ~JOINT/rig and their
// channels.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/ros/parameters.h"

namespace backlash::ros_bridge {

struct JointRig {
  std::string joint;
  rig_file::RigFile rig;  // with the channels of the parameters, where there are some

  /// Where the robot publishes the joint: as declared, or by the names of this package.
  record::ChannelMap channels() const;
};

/// Throws InvalidParameter, BadData, MissingInput.
std::vector<JointRig> load_joint_rigs(Parameters& parameters);

/// The channel map under ~NAME; nothing where there is none. Throws InvalidParameter.
std::optional<record::ChannelMap> read_channels(Parameters& parameters, const std::string& name,
                                                const std::string& joint);

/// The channel map of a joint under its name in the URDF: position, velocity if it is published, and `effort`
/// for the channel that the effort carries.
record::ChannelMap robot_channels(const std::string& joint, record::Channel effort);

/// Path of a joint's file in a folder: slashes in the joint's name are replaced.
std::string joint_path(const std::string& folder, std::string joint, const std::string& ending);

}  // namespace backlash::ros_bridge
