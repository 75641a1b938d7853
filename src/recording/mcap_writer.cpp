// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/recording/mcap_writer.h"

#include <zstd.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <fstream>
#include <map>
#include <utility>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "mcap_format.h"

namespace backlash::recording {
namespace {

constexpr std::size_t kChunkSize = 1 << 20;  // bytes before compression: a choice, as recorders do
constexpr int kZstdLevel = 3;                // a choice: the library's own default

const std::string kSeparator = "\n" + std::string(80, '=') + "\n";

template <typename T>
void put(std::string& to, T value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof(T));
}
void put_text(std::string& to, const std::string& text) {
  put(to, static_cast<std::uint32_t>(text.size()));
  to += text;
}
std::string record_of(Opcode opcode, const std::string& content) {
  std::string record;
  put(record, static_cast<std::uint8_t>(opcode));
  put(record, static_cast<std::uint64_t>(content.size()));
  return record + content;
}
std::uint32_t crc_of(const std::string& bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}
/// A map of channels to numbers.
std::string counts_of(const std::map<std::uint16_t, std::uint64_t>& values) {
  std::string map;
  put(map, static_cast<std::uint32_t>(values.size() * 10));
  for (const auto& [channel, value] : values) {
    put(map, channel);
    put(map, value);
  }
  return map;
}

}  // namespace

const std::string kJointStateType = "sensor_msgs/msg/JointState";
const std::string kJointStateDefinition =
    "std_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort" +
    kSeparator + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id" + kSeparator +
    "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const std::string kStringType = "std_msgs/msg/String";
const std::string kStringDefinition = "string data\n";

struct McapWriter::Impl {
  std::string path;
  std::ofstream out;
  std::uint64_t place = 0;
  boost::crc_32_type crc;
  std::string schemas, channels, chunk_indexes;  // records, for the summary
  std::uint16_t channel_count = 0;
  std::uint32_t chunk_count = 0;
  std::map<std::uint16_t, std::uint64_t> message_counts;
  std::uint64_t first = 0, last = 0, messages = 0;
  std::string chunk;
  std::uint64_t chunk_first = 0, chunk_last = 0;
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index;

  void append(const std::string& bytes) {
    crc.process_bytes(bytes.data(), bytes.size());
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    place += bytes.size();
    if (!out) throw CannotWrite(path + ": cannot be written");
  }

  void flush() {
    if (index.empty()) return;
    std::string packed(ZSTD_compressBound(chunk.size()), '\0');
    const std::size_t size =
        ZSTD_compress(packed.data(), packed.size(), chunk.data(), chunk.size(), kZstdLevel);
    if (ZSTD_isError(size)) throw CannotWrite(path + ": zstd: " + ZSTD_getErrorName(size));
    packed.resize(size);
    std::string content;
    put(content, chunk_first);
    put(content, chunk_last);
    put(content, static_cast<std::uint64_t>(chunk.size()));
    put(content, crc_of(chunk));
    put_text(content, "zstd");
    put(content, static_cast<std::uint64_t>(packed.size()));
    const std::uint64_t start = place;
    append(record_of(kChunk, content + packed));
    write_index(start, packed.size());
    chunk.clear();
    index.clear();
  }

  /// Behind the chunk at `start`, which has just been written.
  void write_index(std::uint64_t start, std::uint64_t packed_size) {
    const std::uint64_t end = place;
    std::map<std::uint16_t, std::uint64_t> offsets;
    for (const auto& [channel, entries] : index) {
      std::string content;
      put(content, channel);
      put(content, static_cast<std::uint32_t>(entries.size() * 16));
      for (const auto& [time, offset] : entries) {
        put(content, time);
        put(content, offset);
      }
      offsets[channel] = place;
      append(record_of(kMessageIndex, content));
    }
    std::string content;
    put(content, chunk_first);
    put(content, chunk_last);
    put(content, start);
    put(content, end - start);
    content += counts_of(offsets);
    put(content, place - end);
    put_text(content, "zstd");
    put(content, packed_size);
    put(content, static_cast<std::uint64_t>(chunk.size()));
    chunk_indexes += record_of(kChunkIndex, content);
    ++chunk_count;
  }

  std::string statistics() const {
    std::string content;
    put(content, messages);
    put(content, channel_count);  // as many schemas as channels
    put(content, static_cast<std::uint32_t>(channel_count));
    put(content, std::uint32_t{0});
    put(content, std::uint32_t{0});
    put(content, chunk_count);
    put(content, first);
    put(content, last);
    return record_of(kStatistics, content + counts_of(message_counts));
  }

  void write_end() {
    std::string content;
    put(content, crc.checksum());
    append(record_of(kDataEnd, content));
    const std::uint64_t summary = place;
    std::string text, offsets;
    const auto group = [&](Opcode opcode, const std::string& records) {
      if (records.empty()) return;
      std::string offset;
      put(offset, static_cast<std::uint8_t>(opcode));
      put(offset, summary + text.size());
      put(offset, static_cast<std::uint64_t>(records.size()));
      offsets += record_of(kSummaryOffset, offset);
      text += records;
    };
    group(kSchema, schemas);
    group(kChannel, channels);
    group(kStatistics, statistics());
    group(kChunkIndex, chunk_indexes);
    std::string footer;
    put(footer, summary);
    put(footer, summary + text.size());
    put(footer, std::uint32_t{0});
    std::string end = text + offsets + record_of(kFooter, footer);
    end.resize(end.size() - 4);
    put(end, crc_of(end));
    append(end + std::string(kMagic.data(), kMagic.size()));
  }
};

McapWriter::McapWriter(const std::string& path) : impl_(std::make_unique<Impl>()) {
  impl_->path = path;
  impl_->out.open(path, std::ios::binary | std::ios::trunc);
  impl_->append(std::string(kMagic.data(), kMagic.size()));
  std::string content;
  put_text(content, "ros2");
  put_text(content, "backlash_diagnosis");
  impl_->append(record_of(kHeader, content));
}

McapWriter::~McapWriter() = default;

std::uint16_t McapWriter::add_channel(const std::string& topic, const std::string& type,
                                      const std::string& definition) {
  const std::uint16_t id = ++impl_->channel_count;  // one schema each, of the same number
  std::string schema, channel;
  put(schema, id);
  put_text(schema, type);
  put_text(schema, "ros2msg");
  put_text(schema, definition);
  put(channel, id);
  put(channel, id);
  put_text(channel, topic);
  put_text(channel, "cdr");
  put(channel, std::uint32_t{0});  // no metadata
  schema = record_of(kSchema, schema);
  channel = record_of(kChannel, channel);
  impl_->schemas += schema;
  impl_->channels += channel;
  impl_->chunk += schema + channel;
  return id;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t time, const Bytes& message) {
  Impl& to = *impl_;
  if (to.index.empty()) to.chunk_first = to.chunk_last = time;
  if (to.messages == 0) to.first = to.last = time;
  to.chunk_first = std::min(to.chunk_first, time);
  to.chunk_last = std::max(to.chunk_last, time);
  to.first = std::min(to.first, time);
  to.last = std::max(to.last, time);
  to.index[channel].emplace_back(time, to.chunk.size());
  std::string content;
  put(content, channel);
  put(content, static_cast<std::uint32_t>(to.message_counts[channel]++));
  put(content, time);
  put(content, time);
  content.append(message.begin(), message.end());
  to.chunk += record_of(kMessage, content);
  ++to.messages;
  if (to.chunk.size() >= kChunkSize) to.flush();
}

void McapWriter::close() {
  impl_->flush();
  impl_->write_end();
  impl_->out.close();
  if (!impl_->out) throw CannotWrite(impl_->path + ": cannot be written");
}

}  // namespace backlash::recording
