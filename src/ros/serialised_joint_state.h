// SPDX-License-Identifier: BSD-3-Clause
// A sensor_msgs/JointState as its bytes lie in a bag.
#pragma once

#include <sensor_msgs/JointState.h>

#include <string>
#include <string_view>

namespace backlash::ros_bridge {

/// Deserialises the messages of one connection into one message, whose arrays keep their room. Names, which
/// are mostly those of the message before, are taken only where they are others.
class JointStateDecoder {
 public:
  /// False where the arrays do not fill the bytes: a damaged length would make a deserialiser reserve what it
  /// asks for. The message is whole only after true; of its header it has the stamp.
  bool decode(std::string_view bytes);

  const sensor_msgs::JointState& message() const { return message_; }

 private:
  bool take_names(std::string_view& bytes);

  sensor_msgs::JointState message_;
  std::string names_;  // the bytes of the names that the message has
};

}  // namespace backlash::ros_bridge
