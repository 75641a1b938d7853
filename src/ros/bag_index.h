// SPDX-License-Identifier: BSD-3-Clause
// The index of a bag: which topics it has, and where in which chunk their messages lie.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace backlash::ros_bridge {

struct BagIndex {
  struct Connection {
    std::uint32_t id;
    std::string topic, type, md5sum;
  };
  struct Entry {             // of a message
    std::uint64_t received;  // ns
    std::uint32_t connection;
    std::uint32_t offset;  // in its chunk
  };
  struct Chunk {
    std::uint64_t place;         // of its record in the file
    std::vector<Entry> entries;  // by connections
  };

  std::vector<Connection> connections;  // those with messages
  std::vector<Chunk> chunks;            // as they lie in the file
};

/// Reads the index without the messages. Throws MissingInput, and BadData "path: reason" where it is not one.
/// What it says of the chunks is not held against them, see bag_structure.h.
BagIndex read_bag_index(const std::string& path);

/// The same of what the chunks themselves hold, up to the first damage. Throws as walk_bag().
BagIndex rebuilt_bag_index(const std::string& path);

}  // namespace backlash::ros_bridge
