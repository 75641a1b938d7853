// SPDX-License-Identifier: BSD-3-Clause
// The `channels` of a rig file: where a robot publishes, or which column of a file holds, what this package
// calls motor_position, load_position, ...
//
//   channels:
//     motor_position: {name: elbow_joint}   # topic joint_states, field position
//     load_position:  {topic: link_encoders, name: elbow, scale: -1, offset: 0.31}
//
//   channels:
//     time:           {column: "t [ms]"}    # or {rate: 1000}, Hz, where the rows have no time
//     motor_position: {column: Encoder, unit: deg}
//     load_position:  {column: 7, unit: deg}                        # by number
//     motor_velocity: {column: speeds, element: 3, unit: rad/s}     # of several numbers in a field
//     motor_torque:   {product: [{column: duty, unit: raw, bits: 16}, {column: supply, unit: V}],
//                      scale: 1e-4, unit: N m}
#pragma once

#include <string>

#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/record/channel_map.h"

namespace backlash::record {

/// The map under `channels`, where the file has one; else the names that this package gives. Throws BadData
/// (file, line, key, value, limit). `linear`: the axis of the rig, whose positions are then lengths. `time`:
/// where the map itself says none.
ChannelMap read_channels(const YamlReader& yaml, const std::string& joint, bool linear = false,
                         const ChannelMap& time = {});

/// `time` of a map under `channels`: which column it is, or the rate.
void read_time(const YamlReader& channels, ChannelMap& map);

/// The time and the columns as read_channels() reads them, a line each.
std::string time_column_text(const ChannelMap& map);
std::string columns_text(const ChannelMap& map, const std::string& indent);

}  // namespace backlash::record
