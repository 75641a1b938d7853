// SPDX-License-Identifier: BSD-3-Clause
#include "bag_delivery.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "bag_format.h"

namespace backlash::ros_bridge {

using namespace bag_format;

bool find_message(std::string_view records, std::uint32_t offset, std::string_view& message) {
  ChunkRecords from(records, offset);
  for (ChunkRecord record; from.next(record) == Step::record;) {
    if (record.operation != kConnection) {
      message = record.data;
      return record.operation == kMessage;
    }
  }
  return false;
}

BagDelivery::BagDelivery(const BagIndex& index, const std::set<std::uint32_t>& connections, Take take)
    : take_(std::move(take)) {
  for (const BagIndex::Chunk& chunk : index.chunks) {
    Planned planned{chunk.place, {}};
    for (const BagIndex::Entry& entry : chunk.entries)
      if (connections.count(entry.connection) > 0) planned.entries.push_back(entry);
    const auto before = [](const BagIndex::Entry& a, const BagIndex::Entry& b) {
      return std::tie(a.received, a.offset) < std::tie(b.received, b.offset);
    };
    if (!std::is_sorted(planned.entries.begin(), planned.entries.end(), before))
      std::sort(planned.entries.begin(), planned.entries.end(), before);
    if (!planned.entries.empty()) plan_.push_back(std::move(planned));
  }
  std::uint64_t before = 0;
  for (Planned& chunk : plan_) {
    before = std::max(before, chunk.entries.back().received);
    chunk.last = before;
  }
  std::uint64_t behind = std::numeric_limits<std::uint64_t>::max();
  for (auto chunk = plan_.rbegin(); chunk != plan_.rend(); ++chunk) {
    chunk->ends = chunk->last <= behind;
    behind = std::min(behind, chunk->entries.front().received);
  }
}

bool BagDelivery::add(std::uint64_t place, std::string_view records) {
  if (next_ == plan_.size() || plan_[next_].place != place) return true;
  const Planned& chunk = plan_[next_++];
  const bool at_once = kept_.empty() && chunk.ends;
  for (const BagIndex::Entry& entry : chunk.entries) {
    std::string_view message;
    if (!find_message(records, entry.offset, message)) return false;
    if (at_once)
      take_(entry.connection, message);
    else
      kept_.push_back({entry.received, entry.connection, std::string(message)});
  }
  if (chunk.ends) finish();
  return true;
}

void BagDelivery::finish() {
  std::stable_sort(kept_.begin(), kept_.end(),
                   [](const Kept& a, const Kept& b) { return a.received < b.received; });
  for (const Kept& kept : kept_) take_(kept.connection, kept.message);
  kept_.clear();
}

}  // namespace backlash::ros_bridge
