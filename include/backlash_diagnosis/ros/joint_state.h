// A record as sensor_msgs/JointState and back: which joint name carries which channel, and how stamps become seconds.
//
//   <joint>_motor       position = motor_position    velocity = motor_velocity   effort = motor_torque
//   <joint>_sensor      position = twist of the input coupling (not recorded)    effort = sensor_torque
//   <joint>_load        position = load_position     velocity = load_velocity
//   <joint>_reference   position = reference_position
//   <joint>_current         effort = motor_current [A]
//   <joint>_accelerometer   effort = acceleration [rad/s^2]
//
// sensor_msgs/JointState has no field for a current or an acceleration; these two are put where a torque would be.
//
// A joint whose name is absent has none of its channels; a NaN, or an empty position, velocity or effort array, means
// "this joint does not have that quantity".
#pragma once

#include <ros/time.h>
#include <sensor_msgs/JointState.h>

#include <array>
#include <string>

#include "backlash_diagnosis/model/gear_train.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash {

struct JointNames {
  explicit JointNames(const std::string& joint);
  std::string motor, sensor, load, reference, current, accelerometer;
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

/// True if the message speaks of this joint at all (a joint_states topic may carry others).
bool mentions(const sensor_msgs::JointState& message, const JointNames& names);

/// Reads one message. Throws BadData naming `topic`, the array and its size where position, velocity or effort are
/// neither empty nor as long as `name`, where a name appears twice, or where a value is infinite.
ChannelValues read_joint_state(const sensor_msgs::JointState& message, const JointNames& names,
                               const std::string& topic);

/// Message for a simulated sample, without stamp.
sensor_msgs::JointState make_joint_state(const Observation& observation, const JointNames& names);

/// Message for sample i of a record, without stamp; only channels that the record has.
sensor_msgs::JointState make_joint_state(const Record& record, std::size_t i, const JointNames& names);

}  // namespace backlash
