// SPDX-License-Identifier: BSD-3-Clause
// Checks of what a bag file promises, before the bag library believes it: that library takes lengths and
// offsets from the file as they are, and a damaged bag would make it read beyond its buffers or never end.
#pragma once

#include <string>

namespace backlash::ros_bridge {

/// Walks over all records of a bag (format 2.0, wiki.ros.org/Bags/Format/2.0): lengths within the file,
/// chunks that unpack to the stated size and are filled with whole records, indexes that point to records.
/// Throws MissingInput when it cannot be opened and BadData "path: reason" when it is not a bag, damaged or
/// not indexed.
void check_bag_structure(const std::string& path);

}  // namespace backlash::ros_bridge
