// SPDX-License-Identifier: BSD-3-Clause
// What bags and recordings of ROS 2 have in common: topics and sensor_msgs/JointState messages.
#pragma once

#include <sensor_msgs/JointState.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace backlash::ros_bridge {

class MessageSource {
 public:
  struct Topic {
    std::string name, type;     // type: printable
    bool joint_states = false;  // this is what it carries, in a form that can be read
  };
  using Take = std::function<void(const sensor_msgs::JointState& message, const std::string& topic)>;

  virtual ~MessageSource() = default;
  /// Throws BadData where the file is damaged, wherever that is; read() finds it as well.
  virtual void check() {}
  virtual std::vector<Topic> topics() = 0;
  /// "sensor_msgs/JointState", as this kind of file names it.
  virtual std::string expected_type() const = 0;
  /// How many messages a topic has, where that is known beforehand; else 0.
  virtual std::size_t expected(const std::string&) const { return 0; }
  /// Text of the first message on /record_info; none where the file has none.
  virtual std::optional<std::string> info() = 0;
  /// Messages on these topics, which all carry joint states, as they were received. Throws BadData.
  virtual void read(const std::vector<std::string>& topics, const Take& take) = 0;
  /// Of the last read.
  virtual std::vector<std::string> warnings() const { return {}; }
};

extern const std::string kInfoTopic;  ///< /record_info

/// Throw MissingInput and BadData.
std::unique_ptr<MessageSource> open_bag(const std::string& path);
std::unique_ptr<MessageSource> open_ros2_recording(const std::string& path);

}  // namespace backlash::ros_bridge
