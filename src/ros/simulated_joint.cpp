// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/simulated_joint.h"

#include <ros/console.h>
#include <std_msgs/String.h>

#include <cmath>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::ros_bridge {
namespace {

constexpr std::chrono::seconds kWarningInterval{1};
const char* const kTopic = "joint_states";  // where the rig file names none

struct LiveNoise {
  record::Channel channel;
  double backlash_diagnosis::SimulatedJointLiveConfig::*value;
};

using Config = backlash_diagnosis::SimulatedJointLiveConfig;
const LiveNoise kLiveNoise[] = {{record::Channel::motor_torque, &Config::noise_motor_torque},
                                {record::Channel::motor_position, &Config::noise_motor_position},
                                {record::Channel::motor_velocity, &Config::noise_motor_velocity},
                                {record::Channel::sensor_torque, &Config::noise_sensor_torque},
                                {record::Channel::load_position, &Config::noise_load_position},
                                {record::Channel::load_velocity, &Config::noise_load_velocity}};

void require_not_negative(const std::string& name, double value) {
  if (!std::isfinite(value) || value < 0)
    throw InvalidParameter(name, to_text(value), "must be finite and >= 0");
}

}  // namespace

SimulatedJoint::SimulatedJoint(const JointSettings& settings, const ros::NodeHandle& handle,
                               const ros::NodeHandle& private_handle)
    : name_(settings.file.rig.joint),
      angular_(settings.file.rig.mesh.angular()),
      names_(name_),
      simulation_(settings.file.rig, settings.file.simulation),
      torque_samples_(static_cast<long>(
          std::ceil(settings.torque_timeout * settings.file.simulation.sensors.sampling_rate))),
      next_torque_warning_(std::chrono::steady_clock::now()),
      handle_(handle) {
  if (const record::ChannelMap& channels = settings.file.channels; channels.declared)
    for (const std::string& topic : channels.topics())
      writers_.emplace(topic, JointStateWriter(channels.on(topic)));
  rig_description_ = handle_.advertise<std_msgs::String>("rig_description", 1, true);
  std_msgs::String description;
  description.data = settings.description;
  rig_description_.publish(description);
  true_backlash_ = handle_.advertise<std_msgs::Float64>("true_backlash", 1, true);
  publish_true_backlash();
  if (settings.file.simulation.excitation.type == "topic")
    torque_command_ = handle_.subscribe("torque_command", 100, &SimulatedJoint::set_torque, this);
  ros::NodeHandle services(private_handle);
  set_backlash_ = services.advertiseService("set_backlash", &SimulatedJoint::set_backlash, this);
  set_rig_ = services.advertiseService("set_rig", &SimulatedJoint::set_rig, this);
  live_ = std::make_unique<LiveServer<Live>>(services, live(), [this](const Live& wanted) { apply(wanted); });
}

std::vector<std::string> SimulatedJoint::topics() const {
  if (writers_.empty()) return {kTopic};
  std::vector<std::string> topics;
  for (const auto& [topic, writer] : writers_) topics.push_back(topic);
  return topics;
}

void SimulatedJoint::step(std::map<std::string, sensor_msgs::JointState>& messages) {
  if (torque_samples_ > 0 && torque_age_++ == torque_samples_) simulation_.plant().set_torque(0);
  const model::Observation sample = simulation_.step();
  if (writers_.empty()) add_joint_state(sample, names_, messages[kTopic]);
  for (const auto& [topic, writer] : writers_) writer.add(sample, messages[topic]);
}

void SimulatedJoint::reset() {
  simulation_.reset();
  publish_true_backlash();
  live_->update(live());
}

void SimulatedJoint::publish_true_backlash() {
  std_msgs::Float64 message;
  message.data = simulation_.plant().gear_train().backlash();
  true_backlash_.publish(message);
}

std::string SimulatedJoint::true_backlash() const {
  return to_text(simulation_.plant().gear_train().backlash()) + (angular_ ? " rad" : " m");
}

void SimulatedJoint::change_backlash(double backlash) {
  require_not_negative("backlash", backlash);
  if (backlash == simulation_.plant().gear_train().backlash()) return;
  simulation_.plant().set_backlash(backlash);
  publish_true_backlash();
  ROS_INFO_STREAM(name_ << ": backlash is " << true_backlash());
}

bool SimulatedJoint::set_backlash(backlash_diagnosis::SetBacklash::Request& request,
                                  backlash_diagnosis::SetBacklash::Response& response) {
  try {
    change_backlash(request.backlash);
    live_->update(live());
    response.success = true;
    response.message = "backlash is " + true_backlash();
  } catch (const Error& error) {
    response.success = false;
    response.message = error.what();
    ROS_WARN_STREAM(name_ << ": set_backlash refused: " << response.message);
  }
  return true;
}

bool SimulatedJoint::set_rig(backlash_diagnosis::SetRig::Request& request,
                             backlash_diagnosis::SetRig::Response& response) {
  try {
    const rig_file::RigFile file = rig_file::rig_file_from_text(request.rig, "set_rig");
    simulation_.plant().set_machine(file.rig);
    publish_true_backlash();
    live_->update(live());
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

SimulatedJoint::Live SimulatedJoint::live() const {
  Live live = Live::__getDefault__();
  live.backlash = simulation_.plant().gear_train().backlash();
  for (const LiveNoise& noise : kLiveNoise)
    live.*noise.value = simulation_.sensors().settings().of(noise.channel).noise;
  return live;
}

void SimulatedJoint::apply(const Live& wanted) {
  for (const LiveNoise& noise : kLiveNoise)
    require_not_negative("noise_" + std::string(record::channel_name(noise.channel)), wanted.*noise.value);
  change_backlash(wanted.backlash);
  for (const LiveNoise& noise : kLiveNoise)
    simulation_.sensors().set_noise(noise.channel, wanted.*noise.value);
}

void SimulatedJoint::set_torque(const std_msgs::Float64& message) {
  if (std::isfinite(message.data)) {
    simulation_.plant().set_torque(message.data);
    torque_age_ = 0;
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (now < next_torque_warning_) return;
  next_torque_warning_ = now + kWarningInterval;
  ROS_WARN_STREAM(torque_command_.getTopic()
                  << ": torque = " << message.data << " refused: must be finite; the last one is held");
}

}  // namespace backlash::ros_bridge
