// SPDX-License-Identifier: BSD-3-Clause
#include "whole_bag.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <memory>

#include "backlash_diagnosis/base/error.h"

namespace backlash::ros_bridge {

void write_whole_bag(const std::string& path, const std::function<void(rosbag::Bag& bag)>& write) {
  const std::string beside = fmt::format("{}.tmp-{}", path, ::getpid());
  auto bag = std::make_unique<rosbag::Bag>();
  try {
    bag->open(beside, rosbag::bagmode::Write);
    write(*bag);
    bag->close();
    std::filesystem::rename(beside, path);
  } catch (const std::exception& e) {
    (void)bag.release();  // its destructor would write again, and end the program where that fails too
    std::error_code ignored;
    std::filesystem::remove(beside, ignored);
    throw CannotWrite(fmt::format("{}: cannot be written: {}", path, e.what()));
  }
}

}  // namespace backlash::ros_bridge
