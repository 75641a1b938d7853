// SPDX-License-Identifier: BSD-3-Clause
#include "bag_index.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <string_view>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "bag_format.h"
#include "bag_structure.h"

namespace backlash::ros_bridge {
namespace {

using namespace bag_format;

class IndexReader {
 public:
  explicit IndexReader(const std::string& path) : path_(path), in_(open_input(path)) {
    in_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(in_.tellg());
  }

  BagIndex read() {
    seek(kVersionLine.size());
    if (next() != kBagHeader) fail("it does not begin with a bag header");
    read_connections(number<std::uint64_t>("index_pos"));
    for (const std::uint64_t place : chunk_places_) index_.chunks.push_back(chunk_at(place));
    index_.connections.erase(
        std::remove_if(index_.connections.begin(), index_.connections.end(),
                       [this](const BagIndex::Connection& c) { return with_messages_.count(c.id) == 0; }),
        index_.connections.end());
    return std::move(index_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw BadData(path_, "damaged bag: " + reason + "; 'rosbag reindex' may save a part of it");
  }

  void seek(std::uint64_t place) {
    if (place > size_) fail("its index points beyond the end of the file");
    place_ = place;
    in_.seekg(static_cast<std::streamoff>(place));
  }

  std::uint32_t length() {
    char bytes[4];
    if (!in_.read(bytes, sizeof bytes)) fail("a record was cut off");
    place_ += sizeof bytes;
    return number_at(bytes);
  }

  void take(std::string& bytes) {
    const std::uint32_t count = length();
    if (count > std::min<std::uint64_t>(kLargestPart, size_ - place_))
      fail("a record has an impossible length");
    bytes.resize(count);
    if (!in_.read(bytes.data(), count)) fail("a record was cut off");
    place_ += count;
  }

  /// Takes the header of the record at the place that was reached, returns what the record is. Its data are
  /// to be taken or skipped.
  int next() {
    take(header_);
    if (!fields_.parse(header_)) fail("a record header does not hold together");
    return fields_.operation();
  }

  void skip_data() {
    const std::uint32_t count = length();
    seek(place_ + count);
  }

  template <typename Number>
  Number number(const char* name) const {
    const std::string_view value = fields_.at(name);
    if (value.size() < sizeof(Number)) fail(std::string("no ") + name + " in a record");
    return number_at<Number>(value.data());
  }

  void read_connections(std::uint64_t index) {
    std::set<std::uint32_t> known;
    for (seek(index); place_ < size_;) {
      const int operation = next();
      take(data_);
      if (operation == kConnection && known.insert(number<std::uint32_t>("conn")).second)
        index_.connections.push_back(connection());
      if (operation != kChunkInfo) continue;
      if (number<std::uint32_t>("ver") != 1) fail("a chunk summary of an unknown version");
      chunk_places_.insert(number<std::uint64_t>("chunk_pos"));
    }
  }

  BagIndex::Connection connection() const {
    Fields described;
    if (!described.parse(data_)) fail("a connection record does not hold together");
    for (const std::string_view needed : {fields_.at("topic"), described.at("type"), described.at("md5sum")})
      if (needed.empty()) fail("a connection record does not name its topic or type");
    return {number<std::uint32_t>("conn"), std::string(fields_.at("topic")),
            std::string(described.at("type")), std::string(described.at("md5sum"))};
  }

  /// The indexes stand behind their chunk.
  BagIndex::Chunk chunk_at(std::uint64_t place) {
    BagIndex::Chunk chunk{place, {}};
    seek(place);
    if (next() != kChunk) fail("a chunk is not where the index says");
    for (skip_data(); place_ < size_ && next() == kIndex;) {
      take(data_);
      if (number<std::uint32_t>("ver") != 1) fail("an index of an unknown version");
      const auto connection = number<std::uint32_t>("conn");
      for (std::size_t i = 0; i + kIndexEntry <= data_.size(); i += kIndexEntry)
        chunk.entries.push_back(
            {number_at(&data_[i]) * std::uint64_t{1'000'000'000} + number_at(&data_[i + 4]), connection,
             number_at(&data_[i + 8])});
      if (!data_.empty()) with_messages_.insert(connection);
    }
    return chunk;
  }

  const std::string path_;
  std::ifstream in_;
  std::uint64_t size_ = 0, place_ = 0;
  std::string header_, data_;  // of the last record
  Fields fields_;              // of header_
  BagIndex index_;
  std::set<std::uint64_t> chunk_places_;
  std::set<std::uint32_t> with_messages_;
};

/// Collects what the records of chunks say of themselves.
class IndexBuilder {
 public:
  void add(std::uint64_t place, std::string_view records) {
    BagIndex::Chunk chunk{place, {}};
    ChunkRecords from(records);
    for (ChunkRecord record; from.next(record) == Step::record;) {
      if (!fields_.parse(record.header) || fields_.at("conn").size() < 4) continue;
      const std::uint32_t connection = number_at(fields_.at("conn").data());
      if (record.operation == kConnection) add_connection(connection, record.data);
      const std::string_view time = fields_.at("time");
      if (record.operation == kMessage && time.size() == 8 && known_.count(connection) > 0)
        chunk.entries.push_back(
            {number_at(time.data()) * std::uint64_t{1'000'000'000} + number_at(time.data() + 4), connection,
             record.offset});
    }
    index_.chunks.push_back(std::move(chunk));
  }

  BagIndex index() { return std::move(index_); }

 private:
  void add_connection(std::uint32_t id, std::string_view data) {
    Fields described;
    if (!described.parse(data) || !known_.insert(id).second) return;
    index_.connections.push_back({id, std::string(fields_.at("topic")), std::string(described.at("type")),
                                  std::string(described.at("md5sum"))});
  }

  Fields fields_;
  std::set<std::uint32_t> known_;
  BagIndex index_;
};

}  // namespace

BagIndex read_bag_index(const std::string& path) {
  return IndexReader(path).read();
}

BagIndex rebuilt_bag_index(const std::string& path) {
  IndexBuilder builder;
  walk_bag(path, [&builder](std::uint64_t place, std::string_view records) {
    builder.add(place, records);
    return true;
  });
  return builder.index();
}

}  // namespace backlash::ros_bridge
