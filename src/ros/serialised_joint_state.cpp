// SPDX-License-Identifier: BSD-3-Clause
#include "serialised_joint_state.h"

#include <cstring>

#include "bag_format.h"

namespace backlash::ros_bridge {
namespace {

using bag_format::number_at;
using bag_format::take_part;

bool take_doubles(std::string_view& bytes, std::vector<double>& values) {
  if (bytes.size() < 4) return false;
  const std::uint32_t count = number_at(bytes.data());
  bytes.remove_prefix(4);
  if (count > bytes.size() / sizeof(double)) return false;
  values.resize(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), count * sizeof(double));
  bytes.remove_prefix(count * sizeof(double));
  return true;
}

}  // namespace

bool JointStateDecoder::decode(std::string_view bytes) {
  constexpr std::size_t kStamp = 4, kFrame = 12;  // behind the sequence number
  if (bytes.size() < kFrame) return false;
  message_.header.stamp.sec = number_at(bytes.data() + kStamp);
  message_.header.stamp.nsec = number_at(bytes.data() + kStamp + 4);
  bytes.remove_prefix(kFrame);
  std::string_view frame;
  return take_part(bytes, frame) && take_names(bytes) && take_doubles(bytes, message_.position) &&
         take_doubles(bytes, message_.velocity) && take_doubles(bytes, message_.effort) && bytes.empty();
}

bool JointStateDecoder::take_names(std::string_view& bytes) {
  // Names carry their own length: the same bytes are the same names, whatever follows.
  if (!names_.empty() && bytes.substr(0, names_.size()) == names_) {
    bytes.remove_prefix(names_.size());
    return true;
  }
  names_.clear();
  const std::string_view whole = bytes;
  if (bytes.size() < 4) return false;
  const std::uint32_t count = number_at(bytes.data());
  bytes.remove_prefix(4);
  if (count > bytes.size() / 4) return false;
  message_.name.resize(count);
  for (std::string& name : message_.name) {
    std::string_view text;
    if (!take_part(bytes, text)) return false;
    name.assign(text);
  }
  names_.assign(whole.substr(0, whole.size() - bytes.size()));
  return true;
}

}  // namespace backlash::ros_bridge
