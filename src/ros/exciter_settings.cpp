// SPDX-License-Identifier: BSD-3-Clause
// Parameters of the node `exciter`.
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/exciter_node.h"
#include "backlash_diagnosis/ros/parameters.h"

namespace backlash::ros_bridge {

const char* exciter_help() {
  return R"(Drives one joint through a test run of its rig file by commanding torque, within limits.

Usage: rosrun backlash_diagnosis exciter _rig:=RIG.yaml _torque_limit:=... [_PARAMETER:=VALUE ...]

Private parameters; unknown ones are refused. Those without a default must be given
  rig             path of the rig file with test_runs and, where the robot has names of its own, channels
  torque_limit    [N m] > 0; a run that would need more is refused
  speed_limit     [rad/s] > 0; a faster joint stops the run. Angles and speeds are those of motor_position
  position_lower  [rad] the run stops where the joint leaves these limits or is about to
  position_upper  [rad]
  duration_limit  [s] > 0; a longer run is refused
  ramp            0.5 s, from zero torque at the start and to zero at the end
  rest            0.5 s, how long the joint is watched before it is driven; it must be at rest
  state_age       0.1 s, a run stops where no state has come for longer
  still           2 s, a run stops where nothing moved for so long at half of its largest torque or more
  rate            200 Hz, of the commands
  dry_run         false; true: goals are checked and reported, nothing is commanded; a goal's
                  bag then holds the plan (plot_excitation.py draws both)
  folder          folder of the bags; without it no goal may ask for one

Publishes
  torque_command  std_msgs/Float64, N m: while a goal runs; several zeros at its end, whatever ended it

Subscribes
  joint_states    sensor_msgs/JointState, or the topics that the rig file's channels name

Action
  ~excite         backlash_diagnosis/Excite: run and bag -> whether it was driven to its end, else why not

A goal is refused where another node publishes torque_command or none listens. A run stops in zero torque: cancel, SIGINT,
SIGTERM, loss of the ROS master, old or wrong states, a limit, a joint that moves against the torque, one that does not
move. Zero torque is no brake: a joint that carries a load needs another way to hold it.
Exit code 0 when asked to end, 64 for a wrong parameter, 65 for a wrong rig file, 66 for a missing one, 70 where the
master was lost.
)";
}

ExciterSettings read_exciter_settings(const ros::NodeHandle& private_handle) {
  Parameters parameters(private_handle);
  ExciterSettings settings;
  const std::string rig = parameters.text("rig", "");
  if (rig.empty()) throw InvalidParameter("~rig", "missing", "must be the path of a rig file");
  const auto required = [&parameters](const char* name, const Range& range, const char* unit) {
    if (!parameters.has(name))
      throw InvalidParameter("~" + std::string(name), "missing", std::string("must be given, in ") + unit);
    return parameters.number(name, 0, range);
  };
  const Range angle = Range::between(-1e6, 1e6);
  settings.limits.torque = required("torque_limit", Range::positive(), "N m");
  settings.limits.speed = required("speed_limit", Range::positive(), "rad/s");
  settings.limits.lower = required("position_lower", angle, "rad");
  settings.limits.upper = required("position_upper", angle, "rad");
  settings.limits.duration = required("duration_limit", Range::positive(), "s");
  simulation::SafeDriveSettings& drive = settings.drive;
  drive.ramp = parameters.number("ramp", drive.ramp, Range::positive());
  drive.rest = parameters.number("rest", drive.rest, Range::positive());
  drive.state_age = parameters.number("state_age", drive.state_age, Range::positive());
  drive.still = parameters.number("still", drive.still, Range::positive());
  settings.rate = parameters.number("rate", settings.rate, Range::between(1, 1e4));
  settings.dry_run = parameters.boolean("dry_run", false);
  settings.folder = parameters.text("folder", "");
  parameters.finish();
  if (settings.limits.upper <= settings.limits.lower)
    throw InvalidParameter("~position_upper", settings.limits.upper, "must be above ~position_lower");
  settings.file = rig_file::load_rig_file(rig);
  return settings;
}

}  // namespace backlash::ros_bridge
