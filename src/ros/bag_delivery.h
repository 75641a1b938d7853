// SPDX-License-Identifier: BSD-3-Clause
// The messages of some connections of a bag, in the order in which they were received.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "bag_index.h"

namespace backlash::ros_bridge {

/// Where a message lies: its bytes among the records of a chunk, from an offset that may be that of a
/// connection record in front of it. False where none lies there.
bool find_message(std::string_view records, std::uint32_t offset, std::string_view& message);

/// Takes the chunks of a bag as they lie in the file and hands on what they have of the connections. Chunks
/// are mostly received one after the other: then a message is handed on where it lies, of its chunk. Where
/// the times of chunks overlap, as in merged bags, their messages are kept until all of them are there.
class BagDelivery {
 public:
  using Take = std::function<void(std::uint32_t connection, std::string_view message)>;

  BagDelivery(const BagIndex& index, const std::set<std::uint32_t>& connections, Take take);

  /// False where the index points to no message.
  bool add(std::uint64_t place, std::string_view records);

  /// Hands on what was kept, where no more chunks follow.
  void finish();

 private:
  struct Planned {
    std::uint64_t place;
    std::vector<BagIndex::Entry> entries;  // as received
    std::uint64_t last = 0;                // receipt of a message in it or before it in the file
    bool ends = false;                     // nothing behind it in the file was received before that
  };
  struct Kept {
    std::uint64_t received;
    std::uint32_t connection;
    std::string message;
  };

  std::vector<Planned> plan_;  // of the chunks that have such messages
  std::size_t next_ = 0;
  std::vector<Kept> kept_;
  Take take_;
};

}  // namespace backlash::ros_bridge
