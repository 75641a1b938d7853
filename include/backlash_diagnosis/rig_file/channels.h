// SPDX-License-Identifier: BSD-3-Clause
// The `channels` of a rig file: where a robot publishes, or which column of a CSV holds, what this package
// calls motor_position, load_position, ...
//
//   channels:
//     motor_position: {name: elbow_joint}   # topic joint_states, field position
//     load_position:  {topic: link_encoders, name: elbow, scale: -1, offset: 0.31}
//
//   channels:
//     time:           {column: "t [ms]"}
//     motor_position: {column: Encoder, unit: deg}
#pragma once

#include <string>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/record/channel_map.h"

namespace backlash::rig_file {

/// The map under `channels`, where the file has one; else the names that this package gives. Throws BadData
/// (file, line, key, value, limit). `linear`: the axis of the rig, whose positions are then lengths.
record::ChannelMap read_channels(const YamlReader& yaml, const std::string& joint, bool linear = false);

}  // namespace backlash::rig_file
