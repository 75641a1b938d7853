// SPDX-License-Identifier: BSD-3-Clause
// Read from the beginning to the end, never by the indexes: a file that was cut off gives what is whole.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/crc.hpp>
#include <cstring>
#include <map>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "mcap_format.h"
#include "open_file.h"
#include "unpack.h"

namespace backlash::recording {
namespace {

constexpr std::uint64_t kBlock = 1 << 16;  // bytes that are read at once of what is skipped

/// Of the file, not of what a message holds: nothing behind it is read.
class Damage : public BadData {
 public:
  Damage(const std::string& where, const std::string& reason) : BadData(where, "damaged: " + reason) {}
};

/// The fields of a record, one after the other.
class Fields {
 public:
  Fields(const std::uint8_t* data, std::size_t size, std::string where)
      : data_(data), size_(size), where_(std::move(where)) {}

  template <typename T>
  T number() {
    T value;
    std::memcpy(&value, bytes(sizeof(T)), sizeof(T));
    return value;
  }
  std::string text() {
    const auto length = number<std::uint32_t>();
    return std::string(reinterpret_cast<const char*>(bytes(length)), length);
  }
  const std::uint8_t* bytes(std::uint64_t count) {
    if (count > size_ - place_) fail("a length does not fit into its record");
    const std::uint8_t* begin = data_ + place_;
    place_ += static_cast<std::size_t>(count);
    return begin;
  }
  std::size_t left() const { return size_ - place_; }
  const std::string& where() const { return where_; }
  [[noreturn]] void fail(const std::string& reason) const { throw Damage(where_, reason); }

 private:
  const std::uint8_t* data_;
  std::size_t size_, place_ = 0;
  std::string where_;
};

std::uint32_t crc_of(const void* data, std::size_t size) {
  boost::crc_32_type crc;
  crc.process_bytes(data, size);
  return crc.checksum();
}

struct Channel {
  std::uint16_t schema = 0;
  std::string topic, encoding;
  bool wanted = false;
};

/// One pass over a file.
class Pass {
 public:
  Pass(const std::string& path, const std::vector<std::string>& topics, const Recording::Take& take)
      : path_(path), topics_(topics.begin(), topics.end()), take_(take), in_(open_input(path)) {
    in_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(std::max<std::streamoff>(0, in_.tellg()));
    in_.seekg(0);
  }

  void run() {
    std::array<char, kMagic.size()> magic{};  // which is that of the format, see open_mcap()
    get(magic.data(), magic.size());
    try {
      while (next()) {
      }
    } catch (const Damage& damage) {
      cut = std::string(damage.what()) + "; nothing behind it was read";
    }
  }

  std::string cut;  // what is reported of a file that ends too early
  std::vector<Topic> found() const {
    std::vector<Topic> all;
    for (const auto& [id, channel] : channels_) {
      const auto schema = schemas_.find(channel.schema);
      all.push_back({channel.topic, schema == schemas_.end() ? "" : schema->second, channel.encoding});
    }
    return all;
  }

 private:
  std::string where(std::uint64_t offset) const { return fmt::format("{}: byte {}", path_, offset); }

  void get(void* to, std::uint64_t count) {
    in_.read(static_cast<char*>(to), static_cast<std::streamsize>(count));
    if (static_cast<std::uint64_t>(in_.gcount()) != count) throw Damage(where(place_), "cannot be read");
    place_ += count;
    crc_.process_bytes(to, static_cast<std::size_t>(count));
  }

  /// One record; false after the last one.
  bool next() {
    const std::uint64_t start = place_;
    const std::uint32_t crc_before = crc_.checksum();
    std::array<char, kRecordHead> head{};
    if (size_ - place_ < head.size()) return ends_early(start);
    get(head.data(), head.size());
    const auto opcode = static_cast<std::uint8_t>(head[0]);
    std::uint64_t length = 0;
    std::memcpy(&length, head.data() + 1, sizeof(length));
    if (length > size_ - place_) return ends_early(start);
    if (!reads(opcode)) {
      skip(length);
      return true;
    }
    if (length > kMostBytes)
      throw Damage(where(start),
                   fmt::format("a record of {} bytes; at most {} can be read", length, kMostBytes));
    content_.resize(static_cast<std::size_t>(length));
    get(content_.data(), length);
    Fields fields(content_.data(), content_.size(), where(start));
    if (opcode == kDataEnd) return end_of_data(fields, crc_before);
    if (opcode == kFooter) return footer(fields);
    if (opcode == kChunk)
      chunk(fields);
    else
      take(opcode, fields, nullptr);
    return true;
  }

  bool reads(std::uint8_t opcode) const {
    if (data_ended_) return opcode == kFooter;
    return opcode == kSchema || opcode == kChannel || opcode == kMessage || opcode == kChunk ||
           opcode == kDataEnd || opcode == kFooter;
  }

  void skip(std::uint64_t length) {
    block_.resize(kBlock);
    for (; length > 0; length -= std::min(length, kBlock)) get(block_.data(), std::min(length, kBlock));
  }

  /// Cut off, or, where the file has its end, damaged before it.
  bool ends_early(std::uint64_t start) {
    std::array<char, kMagic.size()> end{};
    in_.clear();
    in_.seekg(-static_cast<std::streamoff>(end.size()), std::ios::end);
    in_.read(end.data(), end.size());
    if (start != kMagic.size() && end == kMagic)
      throw Damage(where(start), "a record does not fit into the file");
    cut = fmt::format("the file was cut off: nothing after byte {} is whole, nothing there was read", start);
    return false;
  }

  bool end_of_data(Fields& fields, std::uint32_t crc_before) {
    const auto crc = fields.number<std::uint32_t>();
    // Somewhere, nobody knows where.
    if (crc != 0 && crc != crc_before)
      throw BadData(fields.where(), "damaged: the data do not have their check sum");
    data_ended_ = true;
    crc_.reset();  // of the summary begins here
    summary_start_ = place_;
    return true;
  }

  bool footer(Fields& fields) {
    const auto summary = fields.number<std::uint64_t>();
    fields.number<std::uint64_t>();
    const auto crc = fields.number<std::uint32_t>();
    if (!data_ended_) fields.fail("a footer before the end of the data");
    if (crc != 0 && summary == summary_start_) check_summary(fields, crc);
    std::array<char, kMagic.size()> end{};
    if (size_ - place_ != end.size()) {
      if (size_ - place_ > end.size()) fields.fail("more than the magic behind the footer");
      cut = fmt::format("the file was cut off within its last {} bytes; all messages are there", end.size());
      return false;
    }
    get(end.data(), end.size());
    if (end != kMagic) fields.fail("it does not end with its magic");
    return false;
  }

  /// All of it but its own field, which lies at the end of the footer.
  void check_summary(Fields& fields, std::uint32_t crc) {
    const std::uint64_t after = place_;
    in_.seekg(static_cast<std::streamoff>(summary_start_));
    boost::crc_32_type found;
    block_.resize(kBlock);
    for (std::uint64_t left = after - summary_start_ - sizeof(crc); left > 0;) {
      const std::uint64_t count = std::min(left, kBlock);
      in_.read(block_.data(), static_cast<std::streamsize>(count));
      found.process_bytes(block_.data(), static_cast<std::size_t>(count));
      left -= count;
    }
    in_.seekg(static_cast<std::streamoff>(after));
    if (found.checksum() != crc) fields.fail("the summary does not have its check sum");
  }

  void chunk(Fields& fields) {
    fields.bytes(16);  // first and last time
    const auto size = fields.number<std::uint64_t>();
    const auto crc = fields.number<std::uint32_t>();
    const std::string compression = fields.text();
    const auto packed = fields.number<std::uint64_t>();
    const std::uint8_t* data = fields.bytes(packed);
    if (size > kMostBytes)
      fields.fail(fmt::format("a chunk of {} bytes; at most {} can be read", size, kMostBytes));
    Bytes records;
    try {
      unpack(compression, data, static_cast<std::size_t>(packed), static_cast<std::size_t>(size),
             fields.where(), records);
    } catch (const BadData& error) {
      fields.fail(error.what());
    }
    if (crc != 0 && crc != crc_of(records.data(), records.size()))
      fields.fail("the chunk does not have its check sum");
    Fields inside(records.data(), records.size(), fields.where() + " (chunk)");
    std::vector<Message> messages;
    while (inside.left() > 0) {
      const auto opcode = inside.number<std::uint8_t>();
      const auto length = inside.number<std::uint64_t>();
      Fields record(inside.bytes(length), static_cast<std::size_t>(length), inside.where());
      take(opcode, record, &messages);
    }
    const auto earlier = [](const Message* a, const Message* b) { return a->time < b->time; };
    std::vector<const Message*> order;
    for (const Message& message : messages) order.push_back(&message);
    std::stable_sort(order.begin(), order.end(), earlier);
    for (const Message* message : order) take_(*message);
  }

  /// A record of the data; messages of a chunk are put by.
  void take(std::uint8_t opcode, Fields& fields, std::vector<Message>* later) {
    if (opcode == kSchema) {
      const auto id = fields.number<std::uint16_t>();
      const std::string name = fields.text();
      if (schemas_.emplace(id, name).first->second != name) fields.fail("a schema twice, with two names");
    } else if (opcode == kChannel) {
      channel(fields);
    } else if (opcode == kMessage) {
      const auto channel = channels_.find(fields.number<std::uint16_t>());
      if (channel == channels_.end())
        fields.fail("a message on a channel that no earlier record of the file declares");
      if (!channel->second.wanted) return;
      fields.bytes(4);  // sequence number
      const auto log_time = fields.number<std::uint64_t>();
      fields.bytes(8);  // time of publishing
      const std::size_t size = fields.left();
      const Message message{channel->second.topic, log_time, fields.bytes(size), size};
      if (later)
        later->push_back(message);
      else
        take_(message);
    }
  }

  void channel(Fields& fields) {
    const auto id = fields.number<std::uint16_t>();
    Channel channel;
    channel.schema = fields.number<std::uint16_t>();
    channel.topic = fields.text();
    channel.encoding = fields.text();
    channel.wanted = topics_.count(channel.topic) > 0;
    const Channel& known = channels_.emplace(id, channel).first->second;
    if (known.topic != channel.topic || known.schema != channel.schema || known.encoding != channel.encoding)
      fields.fail("a channel twice, with two contents");
  }

  const std::string& path_;
  const std::set<std::string> topics_;
  const Recording::Take& take_;
  std::ifstream in_;
  std::uint64_t size_ = 0, place_ = 0, summary_start_ = 0;
  bool data_ended_ = false;
  boost::crc_32_type crc_;
  Bytes content_;
  std::string block_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
};

class Mcap : public Recording {
 public:
  explicit Mcap(const std::string& path) : path_(path) {}

  std::vector<Topic> topics() override {
    const Take nothing = [](const Message&) {};
    Pass pass(path_, {}, nothing);
    pass.run();
    if (pass.found().empty() && !pass.cut.empty()) throw BadData(path_, pass.cut);
    return pass.found();
  }

  void read(const std::vector<std::string>& topics, const Take& take) override {
    Pass pass(path_, topics, take);
    pass.run();
    cut_ = pass.cut;
  }

  std::vector<std::string> warnings() const override {
    return cut_.empty() ? std::vector<std::string>() : std::vector<std::string>{cut_};
  }

 private:
  const std::string path_;
  std::string cut_;
};

}  // namespace

std::unique_ptr<Recording> open_mcap(const std::string& path) {
  std::ifstream in = open_input(path);  // its errors name the reason
  std::array<char, kMagic.size()> magic{};
  if (!in.read(magic.data(), magic.size()) || magic != kMagic)
    throw BadData(path, "no MCAP file: it does not begin with its magic");
  return std::make_unique<Mcap>(path);
}

}  // namespace backlash::recording
