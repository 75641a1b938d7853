// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/simulated_joint.h"

#include <ros/console.h>

#include "backlash_diagnosis/base/error.h"

namespace backlash::ros_bridge {
namespace {

JointControls::Settings controls_of(const JointSettings& settings) {
  const simulation::SimulationSettings& simulation = settings.file.simulation;
  return {settings.file.rig.joint, settings.file.rig.mesh.angular() ? "rad" : "m",
          simulation.excitation.type == "topic", settings.torque_timeout, simulation.sensors.sampling_rate};
}

}  // namespace

SimulatedJoint::SimulatedJoint(const JointSettings& settings, const ros::NodeHandle& handle,
                               const ros::NodeHandle& private_handle)
    : name_(settings.file.rig.joint),
      title_(name_ + ": simulating " + settings.file.rig.name + " (" + settings.file.source + ")"),
      names_(name_),
      simulation_(settings.file.rig, settings.file.simulation),
      controls_(controls_of(settings), access(settings), handle, private_handle),
      rig_description_(publish_rig_description(handle, settings.description)) {
  if (const record::ChannelMap& channels = settings.file.channels; channels.declared)
    for (const std::string& topic : channels.topics())
      writers_.emplace(topic, JointStateWriter(channels.on(topic)));
  set_rig_ = ros::NodeHandle(private_handle).advertiseService("set_rig", &SimulatedJoint::set_rig, this);
}

JointAccess SimulatedJoint::access(const JointSettings& settings) {
  return {[this] { return simulation_.plant().gear_train().backlash(); },
          [this, most = Range::between(0, settings.file.rig.mesh.most_backlash())](double backlash) {
            if (!most.contains(backlash)) throw InvalidParameter("backlash", backlash, most.text());
            simulation_.plant().set_backlash(backlash);
          },
          [this](double torque) { simulation_.plant().set_torque(torque); },
          [this]() -> simulation::SensorModel& { return simulation_.sensors(); }};
}

std::vector<std::string> SimulatedJoint::topics() const {
  if (writers_.empty()) return {kJointStates};
  std::vector<std::string> topics;
  for (const auto& [topic, writer] : writers_) topics.push_back(topic);
  return topics;
}

void SimulatedJoint::step(std::map<std::string, sensor_msgs::JointState>& messages) {
  controls_.age_torque();
  const model::Observation sample = simulation_.step();
  if (writers_.empty()) add_joint_state(sample, names_, messages[kJointStates]);
  for (const auto& [topic, writer] : writers_) writer.add(sample, messages[topic]);
}

void SimulatedJoint::reset() {
  simulation_.reset();
  controls_.publish();
}

bool SimulatedJoint::set_rig(backlash_diagnosis::SetRig::Request& request,
                             backlash_diagnosis::SetRig::Response& response) {
  try {
    const rig_file::RigFile file = rig_file::rig_file_from_text(request.rig, "set_rig");
    simulation_.plant().set_machine(file.rig);
    controls_.publish();
    response.success = true;
    response.message = "the machine is " + file.rig.name + " of digest " + file.digest;
    ROS_INFO_STREAM(name_ << ": " << response.message);
  } catch (const Error& error) {
    response.success = false;
    response.message = error.what();
    ROS_WARN_STREAM(name_ << ": set_rig refused: " << response.message);
  }
  return true;
}

}  // namespace backlash::ros_bridge
