// SPDX-License-Identifier: BSD-3-Clause
// Bags that are written whole or not at all.
#pragma once

#include <rosbag/bag.h>

#include <functional>
#include <string>

namespace backlash::ros_bridge {

/// Throws CannotWrite.
void write_whole_bag(const std::string& path, const std::function<void(rosbag::Bag& bag)>& write);

}  // namespace backlash::ros_bridge
