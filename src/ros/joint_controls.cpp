// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/joint_controls.h"

#include <ros/console.h>

#include <cmath>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::ros_bridge {
namespace {

constexpr std::chrono::seconds kWarningInterval{1};

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

JointControls::JointControls(Settings settings, JointAccess joint, const ros::NodeHandle& handle,
                             const ros::NodeHandle& private_handle)
    : settings_(std::move(settings)),
      joint_(std::move(joint)),
      torque_samples_(static_cast<long>(std::ceil(settings_.torque_timeout * settings_.sampling_rate))),
      next_torque_warning_(std::chrono::steady_clock::now()),
      handle_(handle) {
  true_backlash_ = handle_.advertise<std_msgs::Float64>("true_backlash", 1, true);
  publish_true_backlash();
  if (settings_.takes_torque)
    torque_command_ = handle_.subscribe("torque_command", 100, &JointControls::set_torque, this);
  ros::NodeHandle services(private_handle);
  set_backlash_ = services.advertiseService("set_backlash", &JointControls::set_backlash, this);
  live_ = std::make_unique<LiveServer<Live>>(services, live(), [this](const Live& wanted) { apply(wanted); });
}

void JointControls::age_torque() {
  if (torque_samples_ > 0 && torque_age_++ == torque_samples_) joint_.set_torque(0);
}

void JointControls::publish() {
  publish_true_backlash();
  live_->update(live());
}

void JointControls::publish_true_backlash() {
  std_msgs::Float64 message;
  message.data = joint_.backlash();
  true_backlash_.publish(message);
}

std::string JointControls::true_backlash() const {
  return to_text(joint_.backlash()) + " " + settings_.unit;
}

void JointControls::change_backlash(double backlash) {
  require_not_negative("backlash", backlash);
  if (backlash == joint_.backlash()) return;
  joint_.set_backlash(backlash);
  publish_true_backlash();
  ROS_INFO_STREAM(settings_.joint << ": backlash is " << true_backlash());
}

bool JointControls::set_backlash(backlash_diagnosis::SetBacklash::Request& request,
                                 backlash_diagnosis::SetBacklash::Response& response) {
  try {
    change_backlash(request.backlash);
    live_->update(live());
    response.success = true;
    response.message = "backlash is " + true_backlash();
  } catch (const Error& error) {
    response.success = false;
    response.message = error.what();
    ROS_WARN_STREAM(settings_.joint << ": set_backlash refused: " << response.message);
  }
  return true;
}

JointControls::Live JointControls::live() const {
  Live live = Live::__getDefault__();
  live.backlash = joint_.backlash();
  for (const LiveNoise& noise : kLiveNoise)
    live.*noise.value = joint_.sensors().settings().of(noise.channel).noise;
  return live;
}

void JointControls::apply(const Live& wanted) {
  for (const LiveNoise& noise : kLiveNoise)
    require_not_negative("noise_" + std::string(record::channel_name(noise.channel)), wanted.*noise.value);
  change_backlash(wanted.backlash);
  for (const LiveNoise& noise : kLiveNoise) joint_.sensors().set_noise(noise.channel, wanted.*noise.value);
}

void JointControls::set_torque(const std_msgs::Float64& message) {
  if (std::isfinite(message.data)) {
    joint_.set_torque(message.data);
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
