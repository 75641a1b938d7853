// SPDX-License-Identifier: BSD-3-Clause
#include "ros/arm/arm_settings.h"

#include "ros/given_parameters.h"

namespace backlash::ros_bridge {
namespace {

const char* const kOfOneJoint[] = {"run",
                                   "joint",
                                   "joints",
                                   "rig_folder",
                                   "backlash",
                                   "half_gap",
                                   "excitation_amplitude",
                                   "excitation_frequency"};

geared_arm::GearedArm load(const std::string& path) {
  geared_arm::GearedArm arm = geared_arm::load_geared_arm(path);
  if (!arm.simulated)
    throw BadData(path, "has no `simulation`: sensors and gravity_compensation are not known");
  for (const arm::JointDrive& joint : arm.rig.joints)
    if (!is_topic_name(joint.name))
      throw BadData(path, "joint '" + printable(joint.name) + "': cannot be part of the name of a topic");
  return arm;
}

}  // namespace

ArmSettings read_arm_settings(Parameters& parameters) {
  for (const char* name : kOfOneJoint)
    if (parameters.has(name))
      throw InvalidParameter(std::string("~") + name, "given",
                             "is for rigs of one joint; ~rig is the file of an arm");
  ArmSettings settings;
  const std::string path = parameters.text("rig", "");
  settings.arm = of_parameter("rig", [&path] { return load(path); });
  settings.urdf = arm::read_urdf(settings.arm.rig.urdf);
  settings.set_robot_description = parameters.boolean("set_robot_description", true);
  GivenParameters given(parameters);
  given.sensors(settings.arm.sensors);
  settings.description = given.description(settings.arm.rig.source, settings.arm.rig.text);
  return settings;
}

}  // namespace backlash::ros_bridge
