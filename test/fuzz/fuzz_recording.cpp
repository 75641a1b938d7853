// SPDX-License-Identifier: BSD-3-Clause
// Bytes as a bag, as an MCAP file or as rosbag2's SQLite file, whichever they begin as, read as a record.
#include <cmath>
#include <fstream>
#include <string_view>

#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "fuzz.h"

using namespace backlash;

namespace {

std::string suffix_of(std::string_view bytes) {
  const auto begins = [&](std::string_view text) { return bytes.substr(0, text.size()) == text; };
  return begins("#ROSBAG") ? ".bag" : begins("\x89MCAP") ? ".mcap" : ".db3";
}

void check(const record::Record& record) {
  fuzz::require(record.size() > 0, "a record without samples");
  for (std::size_t i = 1; i < record.size(); ++i)
    fuzz::require(record.time[i] > record.time[i - 1], "times that do not increase");
  for (const record::Channel channel : record::kChannels)
    for (const double value : record.column(channel)) fuzz::require(!std::isinf(value), "an infinite value");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ScratchFolder folder;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const std::string path = folder.path("recording" + suffix_of(bytes));
  std::remove(path.c_str());  // a file that is written anew is waited for by some file systems
  std::ofstream(path, std::ios::binary) << bytes;
  fuzz::read_or_refuse(path, [&] { check(ros_bridge::read_bag(path)); });
  return 0;
}
