// SPDX-License-Identifier: BSD-3-Clause
// Messages of ROS 2 as they lie in its recordings: XCDR1 (OMG DDSI-RTPS 2.3, 10.5), little or big endian.
// Four bytes of encapsulation header; then the fields, each aligned to its size, counted from behind the
// header.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace backlash::recording {

/// sensor_msgs/msg/JointState without its frame.
struct JointState {
  std::int32_t seconds = 0;       // of header.stamp
  std::uint32_t nanoseconds = 0;  // < 1e9
  std::vector<std::string> name;
  std::vector<double> position, velocity, effort;  // SI units
};

using Bytes = std::vector<std::uint8_t>;

/// Throws BadData "source: field: reason" where lengths do not fit or the header is not that of XCDR1. Up to
/// seven bytes of padding may follow the last field.
void read_cdr(const std::uint8_t* data, std::size_t size, const std::string& source, JointState& message);

/// std_msgs/msg/String.
std::string read_cdr_text(const std::uint8_t* data, std::size_t size, const std::string& source);

Bytes to_cdr(const JointState& message);  ///< little endian
Bytes to_cdr(const std::string& text);    ///< std_msgs/msg/String

}  // namespace backlash::recording
