// SPDX-License-Identifier: BSD-3-Clause
#include "bag_structure.h"

#include <fmt/format.h>
#include <rosbag/chunked_file.h>
#include <rosbag/stream.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <set>
#include <string_view>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "bag_format.h"
#include "recording/unpack.h"

namespace backlash::ros_bridge {
namespace {

using namespace bag_format;

const std::string kMagic = "#ROSBAG V";

/// What a chunk holds: where its records begin.
struct Chunk {
  std::vector<std::uint32_t> records;  // ascending
  std::uint32_t last_message = 0;
  bool has_message = false;
};

class Checker {
 public:
  Checker(const std::string& path, TakeChunk take)
      : path_(path), in_(open_input(path)), take_(std::move(take)) {
    in_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(in_.tellg());
  }

  std::string records_at(std::uint64_t place) {
    place_ = record_start_ = std::min(place, size_);
    in_.seekg(static_cast<std::streamoff>(place_));
    try {
      take_record();
      if (fields_.operation() != kChunk) damaged("a chunk is not where the index says");
      return std::string(records_of_chunk());
    } catch (const Damage& damage) {
      fail(damage.what);
    }
  }

  std::string walk() {
    read_version();
    try {
      while (place_ < size_) {
        record_starts_.insert(place_);
        read_record();
      }
      check_places();
    } catch (const Damage& damage) {
      return damage.what;
    }
    return index_place_ == 0 ? "not indexed, as a recorder leaves it that is killed: read to its end" : "";
  }

 private:
  /// Ends a walk.
  struct Damage {
    std::string what;
  };

  [[noreturn]] void fail(const std::string& reason) const { throw BadData(path_, reason); }

  [[noreturn]] void damaged(const std::string& reason) const {
    throw Damage{fmt::format("damaged bag: {} (byte {} of {}); nothing behind it was read", reason,
                             record_start_, size_)};
  }

  void check_places() const {
    if (!seen_header_) damaged("there is no bag header");
    if (index_place_ == 0) return;
    if (index_place_ != size_ && record_starts_.count(index_place_) == 0)
      damaged("its index is not where it says");
    for (const std::uint64_t chunk : stated_chunks_)
      if (chunk_starts_.count(chunk) == 0) damaged("a chunk is not where the index says");
  }

  void take(std::uint64_t count, const char* what, std::string& bytes) {
    if (count > size_ - place_)
      damaged(std::string(what) + " ends after the end of the file, it was cut off");
    bytes.resize(count);
    if (!in_.read(bytes.data(), static_cast<std::streamsize>(count))) damaged("cannot be read further");
    place_ += count;
  }

  std::uint32_t take_length(const char* what) {
    take(4, what, length_);
    const std::uint32_t length = number_at(length_.data());
    if (length > kLargestPart) damaged(std::string(what) + " has an impossible length");
    return length;
  }

  void read_version() {
    in_.seekg(0);
    if (size_ == 0) fail("not a bag: the file is empty");
    std::string start(std::min<std::uint64_t>(size_, kVersionLine.size()), '\0');
    if (!in_.read(start.data(), static_cast<std::streamsize>(start.size()))) fail("cannot be read");
    place_ = start.size();
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
    const std::string_view value = fields_.at(name);
    if (value.size() != sizeof(std::uint64_t)) damaged(std::string("no ") + name + " in a record");
    return number_at<std::uint64_t>(value.data());
  }

  void take_record() {
    record_start_ = place_;
    take(take_length("a record header"), "a record header", header_);
    if (!fields_.parse(header_)) damaged("a record header does not hold together");
    const std::uint32_t length = take_length("a record");
    cut_ = length > size_ - place_ && fields_.operation() == kChunk && fields_.at("compression") == "none";
    take(cut_ ? size_ - place_ : length, "a record", data_);
  }

  void read_record() {
    take_record();
    const int op = fields_.operation();
    if (!seen_header_ && op != kBagHeader) damaged("it does not begin with a bag header");
    switch (op) {
      case kBagHeader:
        if (seen_header_) damaged("a second bag header");
        seen_header_ = true;
        index_place_ = long_field("index_pos");
        if (const std::string_view by = fields_.at("encryptor"); !by.empty())
          fail("an encrypted bag (by " + printable(std::string(by)) +
               "): 'rosbag decrypt' makes one that can be read");
        break;
      case kChunk:
        chunk_starts_.insert(record_start_);
        read_chunk();
        break;
      case kIndex:
        check_index();
        break;
      case kChunkInfo:
        if (data_.size() != std::uint64_t{8} * field("count"))
          damaged("a chunk summary has the wrong length");
        stated_chunks_.push_back(long_field("chunk_pos"));
        break;
      case kConnection:
        check_connection();
        break;
      default:
        damaged("a record of an unknown kind");
    }
  }

  void check_connection() {
    Fields connection;
    field("conn");
    if (!connection.parse(data_)) damaged("a connection record does not hold together");
  }

  /// Of one that does not hold together the records before the damage are handed on; but the last one may
  /// have been cut, and what follows be taken for its end.
  void read_chunk() {
    std::string_view records = records_of_chunk();
    const std::string problem = walk_chunk(records);
    if (!problem.empty()) records = records.substr(0, chunk_.records.empty() ? 0 : chunk_.records.back());
    const bool taken = !take_ || take_(record_start_, records);
    if (!problem.empty() || cut_)
      damaged(cut_ ? "a chunk ends after the end of the file, it was cut off" : problem);
    if (!taken) damaged("an index points to no message");
  }

  /// Views of what was read last.
  std::string_view records_of_chunk() {
    const std::uint32_t size = field("size");
    if (size > kLargestPart) damaged("a chunk has an impossible length");
    const std::string_view compression = fields_.at("compression");
    if (compression == "none") {
      if (data_.size() != size && !cut_) damaged("a chunk has another length than it says");
      return data_;
    }
    if (compression != "lz4" && compression != "bz2") damaged("a chunk has an unknown compression");
    auto* const packed = reinterpret_cast<std::uint8_t*>(data_.data());
    try {
      if (compression == "lz4")
        recording::unpack("lz4", packed, data_.size(), size, "lz4", unpacked_);
      else
        unpack_bz2(packed, size);
    } catch (const std::exception& e) {
      damaged(std::string("a chunk cannot be unpacked (") + e.what() + ")");
    }
    return {reinterpret_cast<const char*>(unpacked_.data()), unpacked_.size()};
  }

  void unpack_bz2(std::uint8_t* packed, std::uint32_t size) {
    unpacked_.assign(size, 0);  // what a damaged chunk leaves out is nothing
    rosbag::ChunkedFile unused;
    rosbag::StreamFactory streams(&unused);
    streams.getStream(rosbag::compression::BZ2)
        ->decompress(unpacked_.data(), size, packed, static_cast<unsigned>(data_.size()));
  }

  /// What is wrong in it; empty where nothing is.
  std::string walk_chunk(std::string_view bytes) {
    chunk_ = Chunk{std::move(chunk_.records)};
    chunk_.records.clear();
    ChunkRecords records(bytes);
    ChunkRecord record;
    Step step = records.next(record);
    for (; step == Step::record; step = records.next(record)) {
      if (record.operation != kMessage && record.operation != kConnection)
        return "a chunk holds a record of an unknown kind";
      chunk_.records.push_back(record.offset);
      if (record.operation != kMessage) continue;
      chunk_.last_message = record.offset;
      chunk_.has_message = true;
    }
    if (step == Step::bad_header) return "a record header in a chunk does not hold together";
    if (step == Step::bad_length)
      return records.left() < 4 ? "a chunk ends within a record" : "a record reaches beyond its chunk";
    return "";
  }

  /// An index may point to a connection record in front of its message, never behind the last message.
  void check_index() const {
    if (data_.size() != std::uint64_t{kIndexEntry} * field("count")) damaged("an index has the wrong length");
    for (std::size_t i = 0; i < data_.size(); i += kIndexEntry) {
      const std::uint32_t offset = number_at(data_.data() + i + 8);
      if (!chunk_.has_message || offset > chunk_.last_message ||
          !std::binary_search(chunk_.records.begin(), chunk_.records.end(), offset))
        damaged("an index points to no message");
    }
  }

  const std::string path_;
  std::ifstream in_;
  std::uint64_t size_ = 0, place_ = 0, record_start_ = 0, index_place_ = 0;
  bool seen_header_ = false;
  bool cut_ = false;                    // the last record was a chunk that the file does not have to its end
  std::string length_, header_, data_;  // of the last record; their room is used again
  recording::Bytes unpacked_;
  Fields fields_;  // of header_
  TakeChunk take_;
  std::set<std::uint64_t> record_starts_, chunk_starts_;
  std::vector<std::uint64_t> stated_chunks_;
  Chunk chunk_;  // the last one
};

}  // namespace

std::string walk_bag(const std::string& path, const TakeChunk& take) {
  return Checker(path, take).walk();
}

std::string records_of_bag_chunk(const std::string& path, std::uint64_t place) {
  return Checker(path, nullptr).records_at(place);
}

}  // namespace backlash::ros_bridge
