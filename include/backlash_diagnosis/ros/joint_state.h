// SPDX-License-Identifier: BSD-3-Clause
// A record as sensor_msgs/JointState and back, and how stamps become seconds. What is read is given by the
// channel map of each joint (record/channel_map.h, which also has the names that are written).
//
// A joint whose name is absent has none of its channels; a NaN, or an empty position, velocity or effort
// array, means "this joint does not have that quantity".
#pragma once

#include <ros/time.h>
#include <sensor_msgs/JointState.h>

#include <array>
#include <string>
#include <unordered_map>
#include <vector>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::ros_bridge {

struct JointNames {
  explicit JointNames(const std::string& joint);
  std::string robot, motor, sensor, load, reference, current, accelerometer;
};

/// Stamps to seconds since the first one, exact to the nanosecond.
class StampClock {
 public:
  double seconds(const ros::Time& stamp);
  void reset() { started_ = false; }
  const ros::Time& origin() const { return origin_; }
  ros::Time stamp(double seconds) const { return origin_ + ros::Duration().fromSec(seconds); }

 private:
  bool started_ = false;
  ros::Time origin_;
};

/// Reads the messages of one topic. Each name is looked up once; memory is allocated only for errors.
class JointStateReader {
 public:
  /// `joints`: of each joint its sources on this topic.
  explicit JointStateReader(const std::vector<record::ChannelMap>& joints);

  /// The joints of which a message has values, by their place in `joints` (the topic may carry others). The
  /// results here and below are valid until the next call.
  const std::vector<std::size_t>& read(const sensor_msgs::JointState& message);
  const record::ChannelValues& values(std::size_t joint) const { return readings_[joint].values; }
  /// What is wrong with a joint: position, velocity or effort neither empty nor as long as `name` (array and
  /// sizes), a name twice, an infinite value. Empty if nothing is.
  const std::string& problem(std::size_t joint) const { return readings_[joint].problem; }

 private:
  struct Place {  // of a name in a joint
    std::size_t joint;
    unsigned bit;
    bool set_point;  // says nothing of the joint by itself
    std::vector<record::ChannelSource> sources;
  };
  struct Reading {
    record::ChannelValues values;
    std::string problem;
    unsigned seen = 0;  // a bit for each name
    bool any = false;   // more than a set-point
  };

  void take(const sensor_msgs::JointState& message, std::size_t i, const Place& place, Reading& reading);

  std::unordered_map<std::string, std::vector<Place>> places_;
  std::vector<Reading> readings_;
  std::vector<std::size_t> seen_, mentioned_;
};

/// Reads one message of one joint by the names that this package gives. Throws BadData naming `topic` where
/// something is wrong with it.
record::ChannelValues read_joint_state(const sensor_msgs::JointState& message, const std::string& joint,
                                       const std::string& topic);

/// Adds a simulated sample to a message, which may have those of other joints.
void add_joint_state(const model::Observation& observation, const JointNames& names,
                     sensor_msgs::JointState& message);

/// The same of sample i of a record; only channels that the record has.
void add_joint_state(const record::Record& record, std::size_t i, const JointNames& names,
                     sensor_msgs::JointState& message);

/// Adds a simulated sample as a robot publishes a joint, under the name of its URDF: position and velocity of
/// the link, effort = motor torque. For programs that show a robot; the names above say on which end of the
/// gear a value is.
void add_robot_joint(const model::Observation& observation, const std::string& joint,
                     sensor_msgs::JointState& message);

/// A joint of its URDF that stands still at a position [rad; m of a prismatic one].
void add_held_joint(const std::string& joint, double position, sensor_msgs::JointState& message);

/// Empties the arrays of a message in which no name has that quantity.
void empty_if_absent(sensor_msgs::JointState& message);

/// Writes simulated samples of one joint as its channel map reads them, on one topic. The fields of a name
/// that carry no channel are NaN.
class JointStateWriter {
 public:
  /// `sources`: those on this topic.
  explicit JointStateWriter(const record::ChannelMap& sources);

  /// Adds the joint to a message, which may have others.
  void add(const model::Observation& observation, sensor_msgs::JointState& message) const;

 private:
  struct Name {
    std::string name;
    std::vector<record::ChannelSource> sources;
  };
  std::vector<Name> names_;
};

/// Message for a simulated sample, without stamp.
sensor_msgs::JointState make_joint_state(const model::Observation& observation, const JointNames& names);

/// Message for sample i of a record, without stamp; only channels that the record has.
sensor_msgs::JointState make_joint_state(const record::Record& record, std::size_t i,
                                         const JointNames& names);

}  // namespace backlash::ros_bridge
