// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/simulator_settings.h"

namespace backlash::ros_bridge {

const char* simulator_help() {
  return R"(Simulates a gear train with backlash, or an arm of them, and publishes what its sensors measure.

Usage: rosrun backlash_diagnosis simulator [_PARAMETER:=VALUE ...] [NAME:=NEW_NAME ...]

Private parameters; unknown ones are refused. In brackets: units of values that override the rig file
  rig                   path of a rig file; without it the built-in rig of Sarkar et al. (1997). One with urdf is an
                        arm, see below
  rig_folder            folder with a rig file for each joint of a robot, instead of rig: all are simulated (see joints)
  run                   [text] one of the rig file's test_runs: its excitation replaces that of the rig file
  joint                 [text] prefix of the names in joint_states: JOINT_motor, JOINT_sensor, JOINT_load, and
                        JOINT_current, JOINT_accelerometer where the rig file declares these sensors
  joints                list of them instead: so many joints, all in the same messages. Other topics are then below
                        JOINT/, set_backlash is ~JOINT/set_backlash, and a joint's own parameters override the
                        common ones: JOINT/rig, JOINT/run, JOINT/backlash, JOINT/half_gap, JOINT/seed (else the
                        common one plus its place in the list), JOINT/excitation_amplitude, ...frequency
  backlash              [m] total free play along the line of action, >= 0 (rig without base radius: rad)
  half_gap              [m] half of it; give one of the two
  sampling_rate         [Hz] 0.001 to 1e6
  seed                  [-] of the sensor noise, >= 0
  excitation_amplitude  [N m] >= 0, square and sine only
  excitation_frequency  [Hz] > 0, square and sine only
  torque_timeout        0 s; simulated time without a torque_command after which the torque is zero, 0 is never
  real_time_factor      1; 2: twice as fast as wall time, 0: as fast as possible (slow subscribers lose some)
  duration              0 s; simulated time after which the node ends, 0 is endless
  publish_clock         true if real_time_factor is not 1, else false; others follow with /use_sim_time true
  wait_for_subscriber   false; true: the simulation starts when joint_states has a subscriber
  live                  where dynamic_reconfigure keeps what is in force; overwritten at the start
  diagnostic_period     1 s; wall time between two messages on /diagnostics
  set_robot_description true; an arm's URDF becomes the parameter robot_description where there is none

Publishes
  joint_states          sensor_msgs/JointState, every sample; stamps exactly 1/sampling_rate apart, always. A joint whose
                        rig file has `channels` is published as they say: topic, name, field, sign and unit
  rig_description       std_msgs/String, latched: the rig file; a comment in its first line names the source
  true_backlash         std_msgs/Float64, latched: m (rig without base radius: rad)
  /clock                rosgraph_msgs/Clock if publish_clock: 1 to 10 ms apart, from wall time on
  /diagnostics          diagnostic_msgs/DiagnosticArray: lag, samples, real time factor, integrator

Subscribes
  torque_command        std_msgs/Float64, N m, held until the next or ~torque_timeout; for rigs with excitation type topic

Services
  ~set_backlash         backlash_diagnosis/SetBacklash; acts from the last sample on
  ~set_rig              backlash_diagnosis/SetRig; gear train and terms of another rig file from the last sample on
  ~reset                std_srvs/Trigger; at rest in the middle of the gap, backlash as at start; stamps go on
  ~live, ~JOINT/live    dynamic_reconfigure: backlash, noise of each sensor; what is wrong is refused

An arm: all joints in each message of joint_states, as JOINT, the name in the URDF (position and velocity of the
link, torque of the motor, for robot_state_publisher), JOINT_motor and JOINT_load. Other topics are below JOINT/,
services and live parameters below ~JOINT/; backlash is in rad. ~set_rig goes on with links, payloads, drives and
gears of another file of the same joints; gravity compensation believes what it did. Parameters that are for one joint (run, joint, joints, rig_folder, backlash, half_gap, excitation_...) are refused; noise has the seed plus the
joint's place.

Stamps start at the present ROS time. With use_sim_time, real_time_factor 1 and a /clock from elsewhere the
simulation follows that clock, otherwise wall time. Exit code 0 when done, 64 for a wrong parameter, 65 for a
wrong rig file or one whose machine cannot be integrated, 66 for a missing one.
)";
}

}  // namespace backlash::ros_bridge
