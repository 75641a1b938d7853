// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/run_bag.h"

#include <fmt/format.h>
#include <rosbag/bag.h>
#include <std_msgs/Float64.h>
#include <std_msgs/String.h>
#include <unistd.h>

#include <filesystem>
#include <memory>

#include "backlash_diagnosis/base/error.h"

namespace backlash::ros_bridge {
namespace {

const char* const kOutcomeTopic = "/excite_outcome";

void write_all(rosbag::Bag& bag, const RunRecording& recording) {
  ros::Time last(1, 0);  // a bag knows no time 0
  for (const auto& came : recording.states) {
    last = std::max(last, came.at);
    bag.write(recording.topics.at(came.topic), std::max(came.at, ros::TIME_MIN), came.message);
  }
  for (const auto& [at, torque] : recording.commands) {
    last = std::max(last, at);
    std_msgs::Float64 message;
    message.data = torque;
    bag.write(recording.command_topic, std::max(at, ros::TIME_MIN), message);
  }
  std_msgs::String outcome;
  outcome.data = recording.outcome;
  bag.write(kOutcomeTopic, last, outcome);
}

}  // namespace

void write_run_bag(const RunRecording& recording, const std::string& path) {
  const std::string beside = fmt::format("{}.tmp-{}", path, ::getpid());
  auto bag = std::make_unique<rosbag::Bag>();
  try {
    bag->open(beside, rosbag::bagmode::Write);
    write_all(*bag, recording);
    bag->close();
    std::filesystem::rename(beside, path);
  } catch (const std::exception& e) {
    (void)bag.release();  // its destructor would write again, and end the program where that fails too
    std::error_code ignored;
    std::filesystem::remove(beside, ignored);
    throw CannotWrite(fmt::format("{}: cannot be written: {}", path, e.what()));
  }
}

}  // namespace backlash::ros_bridge
