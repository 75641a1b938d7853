// SPDX-License-Identifier: BSD-3-Clause
// Writes MCAP files as ROS 2 does (profile "ros2", messages in CDR), with indexes and check sums, so that its
// tools, Foxglove and PlotJuggler open them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "backlash_diagnosis/recording/cdr.h"

namespace backlash::recording {

extern const std::string kJointStateType;        ///< sensor_msgs/msg/JointState
extern const std::string kJointStateDefinition;  ///< with the messages that it contains
extern const std::string kStringType;            ///< std_msgs/msg/String
extern const std::string kStringDefinition;

class McapWriter {
 public:
  /// Throws CannotWrite, as all of these.
  explicit McapWriter(const std::string& path);
  ~McapWriter();  ///< without close() the file stays unfinished
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  std::uint16_t add_channel(const std::string& topic, const std::string& type, const std::string& definition);
  /// `time`: nanoseconds since 1970, both as received and as published.
  void write(std::uint16_t channel, std::uint64_t time, const Bytes& message);
  void close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace backlash::recording
