// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/recording/cdr.h"

#include <fmt/format.h>

#include <cstring>

#include "backlash_diagnosis/base/error.h"

namespace backlash::recording {
namespace {

constexpr std::size_t kEncapsulation = 4;  // bytes of encapsulation header (DDSI-RTPS)
constexpr std::size_t kMostPadding = 7;    // bytes behind the last field, to a multiple of 8

/// Numbers in the order of the bytes of this machine, which the package runs on: little endian.
class CdrReader {
 public:
  CdrReader(const std::uint8_t* data, std::size_t size, const std::string& source)
      : data_(data), size_(size), source_(source) {
    if (size < kEncapsulation) fail("encapsulation", fmt::format("{} bytes are no message", size));
    if (size >= 4 && std::memcmp(data, "\x28\xB5\x2F\xFD", 4) == 0)
      fail("encapsulation",
           "the message is compressed (zstd, by rosbag2); record without or unpack it first");
    if (data[0] != 0 || data[1] > 1)
      fail("encapsulation", fmt::format("0x{:02x}{:02x}, expected 0x0000 or 0x0001 (CDR)", data[0], data[1]));
    swap_ = data[1] == 0;
  }

  template <typename T>
  T number(const char* field) {
    align(sizeof(T));
    need(sizeof(T), field);
    T value;
    std::uint8_t bytes[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = data_[place_ + (swap_ ? sizeof(T) - 1 - i : i)];
    std::memcpy(&value, bytes, sizeof(T));
    place_ += sizeof(T);
    return value;
  }

  void text(const char* field, std::string& value) {
    const auto length = number<std::uint32_t>(field);
    need(length, field);
    // The length counts the closing zero; some writers give an empty text as length 0.
    if (length > 0 && data_[place_ + length - 1] != 0) fail(field, "a text without its closing zero");
    value.assign(reinterpret_cast<const char*>(data_ + place_), length > 0 ? length - 1 : 0);
    place_ += length;
  }

  void texts(const char* field, std::vector<std::string>& values) {
    const auto count = number<std::uint32_t>(field);
    if (count > (size_ - place_) / 4) fail(field, fmt::format("{} texts do not fit into it", count));
    values.resize(count);
    for (std::string& value : values) text(field, value);
  }

  void numbers(const char* field, std::vector<double>& values) {
    const auto count = number<std::uint32_t>(field);
    if (count > (size_ - place_) / sizeof(double))
      fail(field, fmt::format("{} numbers do not fit into it", count));
    values.resize(count);
    for (double& value : values) value = number<double>(field);
  }

  void finish() const {
    if (size_ - place_ > kMostPadding)
      fail("end", fmt::format("{} bytes behind the last field", size_ - place_));
  }

  [[noreturn]] void fail(const char* field, const std::string& reason) const {
    throw BadData(source_, fmt::format("damaged: {} (byte {}): {}", field, place_, reason));
  }

 private:
  void align(std::size_t to) {
    place_ = kEncapsulation + (place_ - kEncapsulation + to - 1) / to * to;
    if (place_ > size_) place_ = size_;
  }
  void need(std::size_t bytes, const char* field) const {
    if (bytes > size_ - place_) fail(field, "it ends too early");
  }

  const std::uint8_t* data_;
  std::size_t size_, place_ = kEncapsulation;
  const std::string& source_;
  bool swap_ = false;
};

class CdrWriter {
 public:
  template <typename T>
  void number(T value) {
    while ((bytes_.size() - kEncapsulation) % sizeof(T) != 0) bytes_.push_back(0);
    std::uint8_t raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    bytes_.insert(bytes_.end(), raw, raw + sizeof(T));
  }
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.push_back(0);
  }
  void numbers(const std::vector<double>& values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const double value : values) number(value);
  }
  Bytes finished() { return std::move(bytes_); }

 private:
  Bytes bytes_ = {0, 1, 0, 0};
};

}  // namespace

void read_cdr(const std::uint8_t* data, std::size_t size, const std::string& source, JointState& message) {
  CdrReader in(data, size, source);
  message.seconds = in.number<std::int32_t>("header.stamp");
  message.nanoseconds = in.number<std::uint32_t>("header.stamp");
  if (message.nanoseconds >= 1'000'000'000)
    in.fail("header.stamp", fmt::format("nanosec = {}: must be < 1e9", message.nanoseconds));
  std::string frame;
  in.text("header.frame_id", frame);
  in.texts("name", message.name);
  in.numbers("position", message.position);
  in.numbers("velocity", message.velocity);
  in.numbers("effort", message.effort);
  in.finish();
}

std::string read_cdr_text(const std::uint8_t* data, std::size_t size, const std::string& source) {
  CdrReader in(data, size, source);
  std::string text;
  in.text("data", text);
  in.finish();
  return text;
}

Bytes to_cdr(const JointState& message) {
  CdrWriter out;
  out.number(message.seconds);
  out.number(message.nanoseconds);
  out.text("");
  out.number(static_cast<std::uint32_t>(message.name.size()));
  for (const std::string& name : message.name) out.text(name);
  out.numbers(message.position);
  out.numbers(message.velocity);
  out.numbers(message.effort);
  return out.finished();
}

Bytes to_cdr(const std::string& text) {
  CdrWriter out;
  out.text(text);
  return out.finished();
}

}  // namespace backlash::recording
