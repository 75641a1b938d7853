// SPDX-License-Identifier: BSD-3-Clause
// Recordings of ROS 2, read without ROS 2: MCAP files (mcap.dev/spec, version 0) and rosbag2's SQLite files.
// What the messages hold is read by cdr.h.
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

/// The bytes of a message, and when it was received [ns].
struct Message {
  const std::string& topic;
  std::uint64_t time;
  const std::uint8_t* data;
  std::size_t size;
};

class Recording {
 public:
  /// The bytes are valid until it returns.
  using Take = std::function<void(const Message& message)>;

  virtual ~Recording() = default;

  /// In the order in which they turn up; one entry per name, type and encoding.
  virtual std::vector<Topic> topics() = 0;

  /// The messages on some topics as they were received: SQLite by time stamp, MCAP chunk by chunk, sorted by
  /// log time within each, files of a folder by their times. Of a file that is damaged those before the
  /// damage, which warnings() then report; where nothing can be read throws BadData "path: ...".
  virtual void read(const std::vector<std::string>& topics, const Take& take) = 0;

  /// What an operator should know of the last read: a file that was cut off.
  virtual std::vector<std::string> warnings() const { return {}; }
};

/// Whether a path is that of a recording: .mcap, .db3, or a folder with rosbag2's metadata.yaml or such
/// files.
bool is_recording(const std::string& path);

/// Of a folder the files that metadata.yaml names are read, or all where it is not there or does not name
/// them, in the order of their times; of a file only that one. Throws MissingInput when it cannot be opened,
/// BadData when it is no recording or compressed as a whole file.
std::unique_ptr<Recording> open_recording(const std::string& path);

}  // namespace backlash::recording
