// SPDX-License-Identifier: BSD-3-Clause
// Records in bags and in recordings of ROS 2 (recording/recording.h): sensor_msgs/JointState messages, no
// roscore needed. What is said of bags holds for both.
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
/// `topic`: a topic that is this one, or whose last part is it ("/robot/joint_states"), is read.
///
/// Messages are taken in the order of the bag. A repeated stamp loses the later message; that, gaps and
/// jitter are reported in Record::warnings. A channel that is NaN in all messages is absent. Record::name is
/// the path as given.
///
/// Throws MissingInput when the file cannot be opened. Throws BadData, naming the path and where it applies
/// topic, message (from 0) and stamp, when it is no bag, is damaged or not indexed; has no such topic or
/// joint or more than one; when stamps are 0 or go back (looped or merged recordings), a channel is NaN in
/// some messages only, an array has the wrong size or a value is infinite.
record::Record read_bag(const std::string& path, const std::string& joint = "",
                        const std::string& topic = "joint_states");

/// The same by a channel map; where a rig file has none, the joint with the names of this package. Topics
/// after the first are read at its stamps, see sample_joiner.h. Throws BadData too where the bag has not what
/// the map says, naming what it has.
record::Record read_bag(const std::string& path, const record::ChannelMap& channels);

/// One joint of a robot: by the names of this package where the bag has JOINT_motor, as one of a simulated
/// arm does beside the robot's own names; else by the map, which is of the robot's names.
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
