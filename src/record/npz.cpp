// SPDX-License-Identifier: BSD-3-Clause
#include "npz.h"

#include <minizip/unzip.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <optional>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::record {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 30;  // of one array, unpacked; choice: 37 h at 1 kHz
constexpr char kSuffix[] = ".npy";
constexpr std::size_t kMostNames = 1000;  // choice

/// The text behind 'key': in the header, a literal of Python.
std::string header_value(const std::string& header, const std::string& key, const std::string& name) {
  const auto place = header.find("'" + key + "':");
  if (place == std::string::npos) throw BadData(name, "is no array of NumPy: its header has no " + key);
  return std::string(trimmed(std::string_view(header).substr(place + key.size() + 3)));
}

std::vector<std::size_t> shape_of(const std::string& header, const std::string& name) {
  const std::string text = header_value(header, "shape", name);
  const std::string all = text.substr(0, text.find(')') + 1);
  const auto fail = [&] {
    throw BadData(name, "has the shape " + printable(all) + ", expected one or two dimensions");
  };
  std::vector<std::size_t> shape;
  std::size_t number = 0;
  bool digits = false;
  for (const char c : all) {
    if (c >= '0' && c <= '9') {
      number = 10 * number + static_cast<std::size_t>(c - '0');
      digits = true;
      if (number > kMostBytes) fail();
    } else if (digits) {
      shape.push_back(number);
      number = 0, digits = false;
    }
  }
  if (shape.empty() || shape.size() > 2) fail();
  return shape;
}

/// A number of `size` bytes at `data`, of NumPy's kind f, i, u or b.
std::optional<double> number_at(const char* data, char kind, std::size_t size, bool swapped) {
  char bytes[8] = {};
  std::memcpy(bytes, data, size);
  if (swapped) std::reverse(bytes, bytes + size);
  const auto as = [&](auto value) {
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<double>(value);
  };
  switch (kind) {
    case 'f':
      if (size == 8) return as(double{});
      if (size == 4) return as(float{});
      return std::nullopt;
    case 'i':
      return size == 8   ? as(std::int64_t{})
             : size == 4 ? as(std::int32_t{})
             : size == 2 ? as(std::int16_t{})
                         : as(std::int8_t{});
    case 'u':
    case 'b':
      return size == 8   ? as(std::uint64_t{})
             : size == 4 ? as(std::uint32_t{})
             : size == 2 ? as(std::uint16_t{})
                         : as(std::uint8_t{});
    default:
      return std::nullopt;
  }
}

struct Type {
  char kind = 'f';
  std::size_t size = 8;
  bool swapped = false;
};

Type type_of(const std::string& header, const std::string& name) {
  const std::string text = header_value(header, "descr", name);
  const std::string descr =
      text.size() > 4 && text.front() == '\'' ? text.substr(1, text.find('\'', 1) - 1) : "";
  Type type;
  const bool known = descr.size() == 3 && std::strchr("<>|=", descr[0]) != nullptr &&
                     std::strchr("fiub", descr[1]) != nullptr && std::strchr("1248", descr[2]) != nullptr;
  if (known) type = {descr[1], static_cast<std::size_t>(descr[2] - '0'), descr[0] == '>'};
  const char zeros[8] = {};
  if (!known || !number_at(zeros, type.kind, type.size, false))
    throw BadData(name, "holds " + printable(text.substr(0, text.find(", 'fortran"))) +
                            ", expected whole or floating-point numbers of 1 to 8 bytes");
  return type;
}

/// The header and where the numbers begin.
std::pair<std::string, std::size_t> split_header(const std::string& bytes, const std::string& name) {
  constexpr std::string_view kMagic = "\x93NUMPY";
  const auto fail = [&] { throw BadData(name, "is no array of NumPy, or cut off"); };
  if (bytes.size() < 12 || bytes.compare(0, kMagic.size(), kMagic) != 0) fail();
  const auto byte = [&](std::size_t i) {
    return static_cast<std::size_t>(static_cast<unsigned char>(bytes[i]));
  };
  const bool wide = byte(6) > 1;  // version
  const std::size_t start = wide ? 12 : 10;
  const std::size_t length =
      wide ? byte(8) | byte(9) << 8 | byte(10) << 16 | byte(11) << 24 : byte(8) | byte(9) << 8;
  if (length > bytes.size() - start) fail();
  return {bytes.substr(start, length), start + length};
}

}  // namespace

NpyArray parse_npy(const std::string& bytes, const std::string& name) {
  const auto [header, start] = split_header(bytes, name);
  const Type type = type_of(header, name);
  const std::vector<std::size_t> shape = shape_of(header, name);
  const bool by_columns = header_value(header, "fortran_order", name).rfind("True", 0) == 0;
  NpyArray array;
  array.rank = shape.size();
  array.rows = shape[0];
  array.columns = shape.size() > 1 ? shape[1] : 1;
  const std::size_t there = (bytes.size() - start) / type.size;
  if (array.columns != 0 && array.rows > there / array.columns)
    throw BadData(name, "is cut off: " + std::to_string(there) + " numbers, its shape wants " +
                            std::to_string(array.rows) + " times " + std::to_string(array.columns));
  array.values.resize(array.rows * array.columns);
  for (std::size_t i = 0; i < array.values.size(); ++i) {
    const std::size_t at =
        by_columns && array.columns > 1 ? i / array.rows + i % array.rows * array.columns : i;
    array.values[at] = *number_at(bytes.data() + start + i * type.size, type.kind, type.size, type.swapped);
  }
  return array;
}

NpzFile::NpzFile(const std::string& path) : path_(path) {
  open_input(path);  // says why not
  zip_ = unzOpen64(path.c_str());
  if (zip_ == nullptr) throw BadData(path, "is no archive of NumPy (.npz), or cut off");
  try {
    read_names();
  } catch (...) {
    unzClose(zip_);
    throw;
  }
}

void NpzFile::read_names() {
  for (int code = unzGoToFirstFile(zip_); code == UNZ_OK; code = unzGoToNextFile(zip_)) {
    char text[256] = {};
    unz_file_info64 info;
    if (unzGetCurrentFileInfo64(zip_, &info, text, sizeof text - 1, nullptr, 0, nullptr, 0) != UNZ_OK) break;
    const std::string name(text);
    const std::size_t suffix = sizeof kSuffix - 1;
    if (name.size() > suffix && name.compare(name.size() - suffix, suffix, kSuffix) == 0)
      names_.push_back(name.substr(0, name.size() - suffix));
    if (names_.size() > kMostNames) break;
  }
  if (names_.empty()) throw BadData(path_, "holds no array of NumPy");
}

NpzFile::~NpzFile() {
  unzClose(zip_);
}

NpyArray NpzFile::array(const std::string& name) const {
  const std::string place = path_ + ", array " + printable(name);
  const auto require = [&](bool valid, const std::string& reason) {
    if (!valid) throw BadData(place, reason);
  };
  unz_file_info64 info;
  require(unzLocateFile(zip_, (name + kSuffix).c_str(), 1) == UNZ_OK &&
              unzGetCurrentFileInfo64(zip_, &info, nullptr, 0, nullptr, 0, nullptr, 0) == UNZ_OK,
          "is not there");
  require(info.uncompressed_size <= kMostBytes, "has " + std::to_string(info.uncompressed_size) +
                                                    " bytes, at most " + std::to_string(kMostBytes) +
                                                    " are read");
  require(unzOpenCurrentFile(zip_) == UNZ_OK,
          "cannot be unpacked: packed by another method than stored or deflate");
  std::string bytes;
  std::vector<char> part(1 << 16);
  int count = 0;
  while ((count = unzReadCurrentFile(zip_, part.data(), static_cast<unsigned>(part.size()))) > 0 &&
         bytes.size() <= kMostBytes)
    bytes.append(part.data(), static_cast<std::size_t>(count));
  const int closed = unzCloseCurrentFile(zip_);
  require(count == 0 && closed == UNZ_OK,
          "is damaged: its bytes or their sum are not those that were written");
  return parse_npy(bytes, place);
}

}  // namespace backlash::record
