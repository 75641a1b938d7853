// SPDX-License-Identifier: BSD-3-Clause
// Recordings of ROS 2, read without ROS 2: MCAP files (mcap.dev/spec, version 0) and rosbag2's SQLite files.
// What the messages hold is told by cdr.h.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "backlash_diagnosis/recording/cdr.h"

namespace backlash::recording {

struct Topic {
  std::string name, type;  // "/joint_states", "sensor_msgs/msg/JointState"
  std::string encoding;    // of the messages; only "cdr" can be read
};

class Recording {
 public:
  /// Gets topic, bytes of a message and their number; the bytes are valid until it returns.
  using Take = std::function<void(const std::string& topic, const std::uint8_t* data, std::size_t size)>;

  virtual ~Recording() = default;

  /// In the order in which they turn up; one entry per name, type and encoding.
  virtual std::vector<Topic> topics() = 0;

  /// The messages on some topics as they were received: SQLite by time stamp, MCAP chunk by chunk, sorted by
  /// log time within each. Throws BadData "path: ..." with the offset or row where something is damaged.
  virtual void read(const std::vector<std::string>& topics, const Take& take) = 0;

  /// What an operator should know of the last read: a file that was cut off.
  virtual std::vector<std::string> warnings() const { return {}; }
};

/// Whether a path is that of a recording: .mcap, .db3, or a folder with rosbag2's metadata.yaml.
bool is_recording(const std::string& path);

/// Of a folder all its files are read in the order of metadata.yaml, of a file only that one. Throws
/// MissingInput when it cannot be opened, BadData when it is no recording or compressed as a whole file.
std::unique_ptr<Recording> open_recording(const std::string& path);

}  // namespace backlash::recording
