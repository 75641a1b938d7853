// SPDX-License-Identifier: BSD-3-Clause
#include "ros/arm/simulated_arm.h"

#include <ros/console.h>

#include <filesystem>

#include "backlash_diagnosis/base/error.h"

namespace backlash::ros_bridge {
namespace {

/// What stands there already may be wanted, with meshes or of a whole cell: it is left.
void set_robot_description(const ros::NodeHandle& handle, const std::string& urdf) {
  std::string present;
  if (!handle.getParam("robot_description", present))
    handle.setParam("robot_description", urdf);
  else if (present != urdf)
    ROS_WARN_STREAM(handle.resolveName("robot_description")
                    << " is not the URDF of the simulated arm; it is left as it is");
}

}  // namespace

SimulatedArm::SimulatedArm(const ArmSettings& settings, const ros::NodeHandle& handle,
                           const ros::NodeHandle& private_handle)
    : title_("simulating " + settings.arm.rig.name + " (" + settings.arm.rig.source + ")"),
      folder_(std::filesystem::path(settings.arm.rig.source).parent_path().string()),
      held_(settings.arm.rig.held),
      simulation_(settings.arm),
      rig_description_(publish_rig_description(handle, settings.description)) {
  for (std::size_t j = 0; j < settings.arm.joints.size(); ++j) {
    const std::string& joint = settings.arm.rig.joints[j].name;
    const geared_arm::GearedJoint& drive = settings.arm.joints[j];
    names_.emplace_back(joint);
    controls_.emplace_back(
        JointControls::Settings{joint, "rad", !drive.held && drive.excitation.type == "topic",
                                settings.torque_timeout, simulation_.sampling_rate()},
        access(j), ros::NodeHandle(handle, joint), ros::NodeHandle(private_handle, joint));
  }
  if (settings.set_robot_description) set_robot_description(handle, settings.urdf);
  set_rig_ = ros::NodeHandle(private_handle).advertiseService("set_rig", &SimulatedArm::set_rig, this);
}

JointAccess SimulatedArm::access(std::size_t joint) {
  return {[this, joint] { return simulation_.plant().backlash(joint); },
          [this, joint](double backlash) { simulation_.plant().set_backlash(joint, backlash); },
          [this, joint](double torque) { simulation_.plant().set_torque(joint, torque); },
          [this, joint]() -> simulation::SensorModel& { return simulation_.sensors(joint); }};
}

void SimulatedArm::step(std::map<std::string, sensor_msgs::JointState>& messages) {
  for (JointControls& joint : controls_) joint.age_torque();
  const std::vector<model::Observation> samples = simulation_.step();
  sensor_msgs::JointState& message = messages[kJointStates];
  for (std::size_t j = 0; j < samples.size(); ++j) add_robot_joint(samples[j], names_[j].robot, message);
  for (const auto& [joint, position] : held_) add_held_joint(joint, position, message);
  for (std::size_t j = 0; j < samples.size(); ++j) add_joint_state(samples[j], names_[j], message);
}

void SimulatedArm::reset() {
  simulation_.reset();
  for (JointControls& joint : controls_) joint.publish();
}

bool SimulatedArm::set_rig(backlash_diagnosis::SetRig::Request& request,
                           backlash_diagnosis::SetRig::Response& response) {
  try {
    const geared_arm::GearedArm arm = geared_arm::geared_arm_from_text(request.rig, "set_rig", folder_);
    simulation_.plant().set_machine(arm);
    held_ = arm.rig.held;
    for (JointControls& joint : controls_) joint.publish();
    response.success = true;
    response.message = "the arm is " + arm.rig.name + ", " + std::to_string(arm.rig.payloads.size()) +
                       " payloads; backlash is " + true_backlash();
    ROS_INFO_STREAM(response.message);
  } catch (const Error& error) {
    response.success = false;
    response.message = error.what();
    ROS_WARN_STREAM("set_rig refused: " << response.message);
  }
  return true;
}

std::string SimulatedArm::true_backlash() const {
  std::string text;
  for (const JointControls& joint : controls_) text += (text.empty() ? "" : ", ") + joint.true_backlash();
  return text;
}

extern "C" void backlash_read_arm(Parameters& parameters, double torque_timeout, ArmToSimulate& arm) {
  ArmSettings settings = read_arm_settings(parameters);
  settings.torque_timeout = torque_timeout;
  arm.rig = settings.arm.rig.name;
  arm.sampling_rate = settings.arm.sensors.sampling_rate;
  arm.make = [settings = std::move(settings)](const ros::NodeHandle& handle,
                                              const ros::NodeHandle& private_handle) {
    return std::make_unique<SimulatedArm>(settings, handle, private_handle);
  };
}

}  // namespace backlash::ros_bridge
