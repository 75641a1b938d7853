// SPDX-License-Identifier: BSD-3-Clause
#include "bag_structure.h"

#include <fmt/format.h>
#include <rosbag/chunked_file.h>
#include <rosbag/stream.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::ros_bridge {
namespace {

const std::string kMagic = "#ROSBAG V";
const std::string kVersionLine = "#ROSBAG V2.0\n";
constexpr std::uint32_t kLargestPart = std::uint32_t{1}
                                       << 30;  // bytes of a header, of data, of an unpacked chunk
enum Operation { kMessage = 2, kBagHeader = 3, kIndex = 4, kChunk = 5, kChunkInfo = 6, kConnection = 7 };

std::uint32_t number_at(
    const char* bytes) {  // the format and all machines that ROS runs on are little-endian
  std::uint32_t value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

/// The fields of a record header; they are views of its bytes, as there is a header for every message.
class Fields {
 public:
  /// False where the fields do not fill the header.
  bool parse(std::string_view header) {
    all_.clear();
    while (!header.empty()) {
      if (header.size() < 4) return false;
      const std::uint32_t length = number_at(header.data());
      header.remove_prefix(4);
      if (length > header.size()) return false;
      const std::string_view field = header.substr(0, length);
      const auto equals = field.find('=');
      if (equals == std::string_view::npos) return false;
      all_.emplace_back(field.substr(0, equals), field.substr(equals + 1));
      header.remove_prefix(length);
    }
    return true;
  }

  /// Empty where there is none; of several the first.
  std::string_view at(std::string_view name) const {
    for (const auto& [known, value] : all_)
      if (known == name) return value;
    return {};
  }

  int operation() const {
    const std::string_view op = at("op");
    return op.size() == 1 ? op[0] : -1;
  }

 private:
  std::vector<std::pair<std::string_view, std::string_view>> all_;
};

/// What a chunk holds: where its records begin.
struct Chunk {
  std::vector<std::uint32_t> records;  // ascending
  std::uint32_t last_message = 0;
  bool has_message = false;
};

class Checker {
 public:
  explicit Checker(const std::string& path) : path_(path), in_(open_input(path)) {
    in_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(in_.tellg());
  }

  void check() {
    read_version();
    while (place_ < size_) {
      record_starts_.insert(place_);
      read_record();
    }
    if (!seen_header_) fail("there is no bag header");
    if (index_place_ == 0) fail("not indexed (the recording was cut off): try 'rosbag reindex'");
    if (index_place_ != size_ && record_starts_.count(index_place_) == 0)
      damaged("its index is not where it says");
    for (const std::uint64_t chunk : stated_chunks_)
      if (chunk_starts_.count(chunk) == 0) damaged("a chunk is not where the index says");
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const { throw BadData(path_, reason); }

  [[noreturn]] void damaged(const std::string& reason) const {
    fail(fmt::format("damaged bag: {} (byte {}); 'rosbag reindex' may save the part before it", reason,
                     record_start_));
  }

  std::string take(std::uint64_t count, const char* what) {
    if (count > size_ - place_)
      damaged(std::string(what) + " ends after the end of the file, it was cut off");
    std::string bytes(count, '\0');
    if (!in_.read(bytes.data(), static_cast<std::streamsize>(count))) fail("cannot be read further");
    place_ += count;
    return bytes;
  }

  std::uint32_t take_length(const char* what) {
    const std::uint32_t length = number_at(take(4, what).data());
    if (length > kLargestPart) damaged(std::string(what) + " has an impossible length");
    return length;
  }

  void read_version() {
    in_.seekg(0);
    if (size_ == 0) fail("not a bag: the file is empty");
    const std::string start = take(std::min<std::uint64_t>(size_, kVersionLine.size()), "version");
    if (start.compare(0, kMagic.size(), kMagic) != 0)
      fail("not a bag: it starts with '" + printable(start) + "'");
    if (start != kVersionLine) fail("a bag of another format than 2.0 ('" + printable(start) + "')");
  }

  std::uint32_t field(const char* name) const {
    const std::string_view value = fields_.at(name);
    if (value.size() < 4) damaged(std::string("no ") + name + " in a record");
    return number_at(value.data());
  }

  std::uint64_t long_field(const char* name) const {
    const std::string_view bytes = fields_.at(name);
    std::uint64_t value;
    if (bytes.size() != sizeof value) damaged(std::string("no ") + name + " in a record");
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }

  void read_record() {
    record_start_ = place_;
    header_ = take(take_length("a record header"), "a record header");
    if (!fields_.parse(header_)) damaged("a record header does not hold together");
    const std::string data = take(take_length("a record"), "a record");
    const int op = fields_.operation();
    if (!seen_header_ && op != kBagHeader) damaged("it does not begin with a bag header");
    switch (op) {
      case kBagHeader:
        if (seen_header_) damaged("a second bag header");
        seen_header_ = true;
        index_place_ = long_field("index_pos");
        break;
      case kChunk:
        chunk_starts_.insert(record_start_);
        chunk_ = read_chunk(data);
        break;
      case kIndex:
        check_index(data);
        break;
      case kChunkInfo:
        if (data.size() != std::uint64_t{8} * field("count")) damaged("a chunk summary has the wrong length");
        stated_chunks_.push_back(long_field("chunk_pos"));
        break;
      case kConnection:
        check_connection(data);
        break;
      default:
        damaged("a record of an unknown kind");
    }
  }

  void check_connection(const std::string& data) {
    Fields connection;
    field("conn");
    if (!connection.parse(data)) damaged("a connection record does not hold together");
  }

  Chunk read_chunk(const std::string& packed) {
    const std::uint32_t size = field("size");
    if (size > kLargestPart) damaged("a chunk has an impossible length");
    const std::string_view compression = fields_.at("compression");
    if (compression == "none") {
      if (packed.size() != size) damaged("a chunk has another length than it says");
      return walk_chunk(packed);
    }
    if (compression != "lz4" && compression != "bz2") damaged("a chunk has an unknown compression");
    return walk_chunk(
        unpacked(packed, size, compression == "lz4" ? rosbag::compression::LZ4 : rosbag::compression::BZ2));
  }

  std::string unpacked(const std::string& packed, std::uint32_t size, rosbag::CompressionType type) {
    std::string bytes(size, '\0');
    rosbag::ChunkedFile unused;
    rosbag::StreamFactory streams(&unused);
    std::string source = packed;  // the interface wants it writable
    try {
      streams.getStream(type)->decompress(reinterpret_cast<std::uint8_t*>(bytes.data()), size,
                                          reinterpret_cast<std::uint8_t*>(source.data()),
                                          static_cast<unsigned>(source.size()));
    } catch (const std::exception& e) {
      damaged(std::string("a chunk cannot be unpacked (rosbag: ") + e.what() + ")");
    }
    return bytes;
  }

  Chunk walk_chunk(std::string_view bytes) const {
    Chunk chunk;
    Fields fields;
    for (std::size_t place = 0; place < bytes.size();) {
      const auto start = static_cast<std::uint32_t>(place);
      const auto part = [&]() -> std::string_view {
        if (bytes.size() - place < 4) damaged("a chunk ends within a record");
        const std::uint32_t length = number_at(bytes.data() + place);
        place += 4;
        if (length > bytes.size() - place) damaged("a record reaches beyond its chunk");
        place += length;
        return bytes.substr(place - length, length);
      };
      if (!fields.parse(part())) damaged("a record header in a chunk does not hold together");
      part();
      const int op = fields.operation();
      if (op != kMessage && op != kConnection) damaged("a chunk holds a record of an unknown kind");
      chunk.records.push_back(start);
      if (op == kMessage) {
        chunk.last_message = start;
        chunk.has_message = true;
      }
    }
    return chunk;
  }

  /// An index may point to a connection record in front of its message, never behind the last message.
  void check_index(const std::string& data) const {
    constexpr std::size_t kEntry = 12;  // time, offset
    if (data.size() != std::uint64_t{kEntry} * field("count")) damaged("an index has the wrong length");
    for (std::size_t i = 0; i < data.size(); i += kEntry) {
      const std::uint32_t offset = number_at(data.data() + i + 8);
      if (!chunk_.has_message || offset > chunk_.last_message ||
          !std::binary_search(chunk_.records.begin(), chunk_.records.end(), offset))
        damaged("an index points to no message");
    }
  }

  const std::string path_;
  std::ifstream in_;
  std::uint64_t size_ = 0, place_ = 0, record_start_ = 0, index_place_ = 0;
  bool seen_header_ = false;
  std::string header_;
  Fields fields_;  // of header_
  std::set<std::uint64_t> record_starts_, chunk_starts_;
  std::vector<std::uint64_t> stated_chunks_;
  Chunk chunk_;  // the last one
};

}  // namespace

void check_bag_structure(const std::string& path) {
  Checker(path).check();
}

}  // namespace backlash::ros_bridge
