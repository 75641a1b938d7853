// SPDX-License-Identifier: BSD-3-Clause
// The parts that a bag file (format 2.0, wiki.ros.org/Bags/Format/2.0) is made of.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace backlash::ros_bridge::bag_format {

enum Operation { kMessage = 2, kBagHeader = 3, kIndex = 4, kChunk = 5, kChunkInfo = 6, kConnection = 7 };

inline const std::string kVersionLine = "#ROSBAG V2.0\n";

/// Bytes of a header, of data, of an unpacked chunk.
constexpr std::uint32_t kLargestPart = std::uint32_t{1} << 30;
constexpr std::size_t kIndexEntry = 12;  ///< bytes of an index per message: seconds, nanoseconds, offset

/// Of the first bytes; the format and all machines that ROS runs on are little-endian.
template <typename Number = std::uint32_t>
Number number_at(const char* bytes) {
  Number value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

/// Takes a length and as many bytes from the front of `bytes`; false where it has not as many.
inline bool take_part(std::string_view& bytes, std::string_view& part) {
  if (bytes.size() < 4) return false;
  const std::uint32_t length = number_at(bytes.data());
  if (length > bytes.size() - 4) return false;
  part = bytes.substr(4, length);
  bytes.remove_prefix(4 + std::size_t{length});
  return true;
}

/// Hands the fields of a record header to `take(name, value)`; false where they do not fill the header.
template <typename Take>
bool take_fields(std::string_view header, const Take& take) {
  std::string_view field;
  while (take_part(header, field)) {
    const auto equals = field.find('=');
    if (equals == std::string_view::npos) return false;
    take(field.substr(0, equals), field.substr(equals + 1));
  }
  return header.empty();
}

/// What kind of record a value of the field "op" means; -1 where it is none.
inline int operation_of(std::string_view value) {
  return value.size() == 1 ? value[0] : -1;
}

/// The fields of a record header, views of its bytes.
class Fields {
 public:
  /// False where the fields do not fill the header.
  bool parse(std::string_view header) {
    all_.clear();
    return take_fields(
        header, [this](std::string_view name, std::string_view value) { all_.emplace_back(name, value); });
  }

  /// Empty where there is none; of several the first.
  std::string_view at(std::string_view name) const {
    for (const auto& [known, value] : all_)
      if (known == name) return value;
    return {};
  }

  int operation() const { return operation_of(at("op")); }

 private:
  std::vector<std::pair<std::string_view, std::string_view>> all_;
};

/// A record of a chunk: its operation (-1 where it has none), header and data, and where it begins.
struct ChunkRecord {
  std::uint32_t offset = 0;
  int operation = -1;
  std::string_view header, data;
};

enum class Step { record, end, bad_length, bad_header };

/// Goes through the records of a chunk; there is one for every message.
class ChunkRecords {
 public:
  explicit ChunkRecords(std::string_view bytes, std::size_t offset = 0)
      : bytes_(bytes), rest_(bytes.substr(std::min(offset, bytes.size()))) {}

  Step next(ChunkRecord& record) {
    if (rest_.empty()) return Step::end;
    record.offset = static_cast<std::uint32_t>(bytes_.size() - rest_.size());
    record.operation = -1;
    if (!take_part(rest_, record.header)) return Step::bad_length;
    bool known = false;  // of several the first
    const bool whole = take_fields(record.header, [&](std::string_view name, std::string_view value) {
      if (!known && name == "op") known = true, record.operation = operation_of(value);
    });
    if (!whole) return Step::bad_header;
    return take_part(rest_, record.data) ? Step::record : Step::bad_length;
  }

  std::size_t left() const { return rest_.size(); }

 private:
  std::string_view bytes_, rest_;
};

}  // namespace backlash::ros_bridge::bag_format
