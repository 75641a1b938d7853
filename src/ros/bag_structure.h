// SPDX-License-Identifier: BSD-3-Clause
// Checks of what a bag file promises, before the bag library believes it: that library takes lengths and
// offsets from the file as they are, and a damaged bag would make it read beyond its buffers or never end.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace backlash::ros_bridge {

/// Gets the place of a chunk in the file and its records, unpacked; false where the index of the bag points
/// to no message among them.
using TakeChunk = std::function<bool(std::uint64_t place, std::string_view records)>;

/// Walks over all records of a bag (format 2.0, wiki.ros.org/Bags/Format/2.0): lengths within the file,
/// chunks that unpack to the stated size and are filled with whole records, indexes that point to records.
/// Hands on each chunk that holds together, and of the last one before a damage the records that do. Returns
/// what is damaged and where, behind which nothing was read; empty of a sound bag. Throws MissingInput when
/// it cannot be opened and BadData "path: reason" when it is not a bag or encrypted.
std::string walk_bag(const std::string& path, const TakeChunk& take = nullptr);

/// The records of the chunk at a place, unpacked. Throws BadData where there is none.
std::string records_of_bag_chunk(const std::string& path, std::uint64_t place);

}  // namespace backlash::ros_bridge
