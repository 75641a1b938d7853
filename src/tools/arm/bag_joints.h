// SPDX-License-Identifier: BSD-3-Clause
// Which joints a recording has, before any rig file says so.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/record/channel_map.h"

namespace backlash::tools {

struct FoundJoint {
  std::string joint;
  record::ChannelMap channels;  // by its own names, or declared: where the recording has them
};

/// Of a bag: each JOINT_motor with what this package publishes beside it, else each name that has a position
/// and an effort. A name with a position alone is the encoder of a link where it goes along with one of those
/// (rig_draft/seen_joint.h): `load_position` of the joint that it is nearest to. Throws as read_bag; BadData
/// where there is no joint.
std::vector<FoundJoint> joints_of_bag(const std::string& path);

}  // namespace backlash::tools
