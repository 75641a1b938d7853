// SPDX-License-Identifier: BSD-3-Clause
// Records in bags and in recordings of ROS 2 (recording/recording.h): sensor_msgs/JointState messages, no
// roscore needed. Below, "bag" stands for both.
//
// Only header stamps count, never the time at which a message was received. A bag written here says by a
// latched std_msgs/String message on the topic `record_info` which stamp is time 0 of its record, as YAML:
//   {name: "run.csv", time_origin: {secs: 1000000000, nsecs: 0}}
// so that CSV -> bag -> CSV gives the same times. Without it (any recorded bag) time 0 is the first stamp.
#pragma once

#include <ros/time.h>

#include <string>
#include <vector>

#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::ros_bridge {

extern const ros::Time kBagTimeOrigin;  ///< 1e9 s: stamp of time 0 in written bags, as ROS refuses stamp 0

/// Reads the record of one joint.
///
/// `joint`: prefix of its names (see joint_state.h); empty: the only one that the bag has.
/// `topic`: the topic of this name, or one whose last part it is ("/robot/joint_states"), is read.
///
/// Messages are taken in the order of the bag. Of messages with the same stamp the first is kept; repeated
/// stamps, gaps and jitter are reported in Record::warnings. A channel that is NaN in all messages is absent.
/// Record::name is the path as given.
///
/// Throws MissingInput when the file cannot be opened. Throws BadData, naming the path and where it applies
/// topic, message (from 0) and stamp, when it is no bag, is damaged or not indexed; has no such topic or
/// joint or more than one; when stamps are 0 or go back (looped or merged recordings), a channel is NaN in
/// some messages only, an array has the wrong size or a value is infinite.
record::Record read_bag(const std::string& path, const std::string& joint = "",
                        const std::string& topic = "joint_states");

/// The same by a channel map, which without a rig file's `channels` has the names of this package. Values of
/// the other topics are taken at the stamps of the first, see sample_joiner.h. Throws BadData also if the bag
/// lacks what the map names; the message says what the bag has.
record::Record read_bag(const std::string& path, const record::ChannelMap& channels);

/// One joint of a robot. If the bag has JOINT_motor, as that of a simulated arm beside the robot's own names,
/// it is read by the names of this package, else by the map `stock` of the robot's names.
record::Record read_robot_bag(const std::string& path, const record::ChannelMap& stock);

/// Writes a record as messages of `joint` on /joint_states, stamped `origin` + time (rounded to 1 ns), whole
/// or not at all. Throws CannotWrite when the file cannot be written, BadData when read_bag would not read it
/// back: no samples or channels, columns of unequal length, values that are not finite, times that do not
/// increase by a nanosecond or whose stamp ROS cannot hold.
void write_bag(const record::Record& record, const std::string& path, const std::string& joint,
               const ros::Time& origin = kBagTimeOrigin);

/// The same as a recording of ROS 2 (recording/mcap_writer.h), whose stamps end in 2038.
void write_mcap(const record::Record& record, const std::string& path, const std::string& joint,
                const ros::Time& origin = kBagTimeOrigin);

/// Several joints with the same times, in the same messages. Throws besides InvalidParameter for no joint or
/// one without a name, BadData where times differ.
void write_bag(const std::vector<record::JointRecord>& joints, const std::string& path,
               const ros::Time& origin = kBagTimeOrigin);
void write_mcap(const std::vector<record::JointRecord>& joints, const std::string& path,
                const ros::Time& origin = kBagTimeOrigin);

}  // namespace backlash::ros_bridge
