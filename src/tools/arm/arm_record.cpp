// SPDX-License-Identifier: BSD-3-Clause
#include "tools/arm/arm_record.h"

#include <filesystem>

#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/sample_joiner.h"
#include "backlash_diagnosis/record/table_file.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "backlash_diagnosis/ros/joint_rigs.h"
#include "tools/common/record_file.h"

namespace backlash::tools {

namespace fs = std::filesystem;

std::vector<record::JointRecord> read_joints(const std::string& path, const arm::ArmRig& rig) {
  check_record_path(path);
  std::vector<record::JointRecord> joints;
  const bool columns = !rig.joints.empty() && !rig.joints.front().channels.columns.empty();
  if (record::is_table_file(path) || (columns && fs::path(path).extension() == ".csv")) {
    for (const arm::JointDrive& joint : rig.joints)
      joints.push_back({joint.name, record::read_table(path, joint.channels)});
  } else if (fs::path(path).extension() != ".csv") {
    for (const arm::JointDrive& joint : rig.joints)
      joints.push_back({joint.name, ros_bridge::read_robot_bag(
                                        path, ros_bridge::robot_channels(joint.name, rig.channel))});
  } else {
    joints = record::read_joints_csv(path);
  }
  // What is seen of one joint at a time is cut out of all: each has its own clock in a bag.
  for (record::JointRecord& joint : joints) record::set_origin(joint.record, joints.front().record.origin);
  return joints;
}

arm::ArmRecord admitted_arm_record(const std::string& path, const arm::ArmRig& rig, RecordDoor& door) {
  return arm::arm_record(door.admit(read_joints(path, rig), path), rig, fs::path(path).filename());
}

}  // namespace backlash::tools
