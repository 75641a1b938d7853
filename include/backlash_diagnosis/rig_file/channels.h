// SPDX-License-Identifier: BSD-3-Clause
// The `channels` of a rig file: where a robot publishes what this package calls motor_position,
// load_position, ...
//
//   channels:
//     motor_position: {name: elbow_joint}                                  # topic joint_states, field
//     position motor_torque:   {name: elbow_joint, scale: 11.7}                     # N m/A: the effort is a
//     current load_position:  {topic: link_encoders, name: elbow, scale: -1, offset: 0.31}
#pragma once

#include <string>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/record/channel_map.h"

namespace backlash::rig_file {

/// The map under `channels`, where the file has one; else the names that this package gives. Throws BadData
/// (file, line, key, value, limit).
record::ChannelMap read_channels(const YamlReader& yaml, const std::string& joint);

}  // namespace backlash::rig_file
