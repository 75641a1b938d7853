// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/recording/mcap_writer.h"
#include "backlash_diagnosis/recording/recording.h"
#include "message_source.h"

namespace backlash::ros_bridge {
namespace {

class Ros2Source : public MessageSource {
 public:
  explicit Ros2Source(const std::string& path) : path_(path), recording_(recording::open_recording(path)) {}

  std::vector<Topic> topics() override {
    std::vector<Topic> all;
    for (const recording::Topic& topic : known()) {
      std::string type = printable(topic.type);
      if (topic.encoding != "cdr") type += " in encoding '" + printable(topic.encoding) + "'";
      all.push_back({topic.name, type, topic.encoding == "cdr" && topic.type == recording::kJointStateType});
    }
    return all;
  }

  std::string expected_type() const override { return recording::kJointStateType + " in encoding 'cdr'"; }

  std::optional<std::string> info() override {
    bool there = false;
    for (const recording::Topic& topic : known()) {
      if (topic.name != kInfoTopic) continue;
      if (topic.encoding != "cdr" || topic.type != recording::kStringType) return std::nullopt;
      there = true;
    }
    std::optional<std::string> text;
    if (there)
      recording_->read({kInfoTopic}, [&](const recording::Message& m) {
        if (!text) text = recording::read_cdr_text(m.data, m.size, path_ + ": " + kInfoTopic);
      });
    return text;
  }

  void read(const std::vector<std::string>& topics, const Take& take) override {
    std::map<std::string, std::size_t> counts;
    recording::JointState read;
    sensor_msgs::JointState message;
    recording_->read(topics, [&](const recording::Message& m) {
      const auto source = fmt::format("{}: {} message {}", path_, printable(m.topic), counts[m.topic]++);
      recording::read_cdr(m.data, m.size, source, read);
      if (read.seconds < 0)
        throw BadData(source, fmt::format("header.stamp = {} s: must not be before 1970", read.seconds));
      message.header.stamp = ros::Time(static_cast<std::uint32_t>(read.seconds), read.nanoseconds);
      message.name.swap(read.name);
      message.position.swap(read.position);
      message.velocity.swap(read.velocity);
      message.effort.swap(read.effort);
      take(message, m.topic);
    });
  }

  std::vector<std::string> warnings() const override { return recording_->warnings(); }

 private:
  const std::vector<recording::Topic>& known() {
    if (topics_.empty()) topics_ = recording_->topics();
    return topics_;
  }

  const std::string path_;
  std::unique_ptr<recording::Recording> recording_;
  std::vector<recording::Topic> topics_;
};

}  // namespace

std::unique_ptr<MessageSource> open_ros2_recording(const std::string& path) {
  return std::make_unique<Ros2Source>(path);
}

}  // namespace backlash::ros_bridge
