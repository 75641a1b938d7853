// SPDX-License-Identifier: BSD-3-Clause
// Bags are read once, chunk by chunk, each checked before its messages are taken: the bag library would check
// nothing, and its views make an object for every message.
#include <fmt/format.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <map>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "bag_delivery.h"
#include "bag_format.h"
#include "bag_index.h"
#include "bag_structure.h"
#include "message_source.h"
#include "serialised_joint_state.h"

namespace backlash::ros_bridge {
namespace {

template <typename Message>
bool is_type(const BagIndex::Connection& c) {
  return c.type == ros::message_traits::DataType<Message>::value() &&
         c.md5sum == ros::message_traits::MD5Sum<Message>::value();
}

/// A bag that was cut off has none, or one that points beyond its end.
BagIndex index_of(const std::string& path) {
  try {
    return read_bag_index(path);
  } catch (const BadData&) {
    return rebuilt_bag_index(path);
  }
}

class BagSource : public MessageSource {
 public:
  explicit BagSource(const std::string& path) : path_(path), index_(index_of(path)) {}

  void check() override {
    if (const std::string damage = walk_bag(path_); !damage.empty()) throw BadData(path_, damage);
  }

  std::vector<std::string> warnings() const override {
    return damage_.empty() ? std::vector<std::string>() : std::vector<std::string>{damage_};
  }

  std::vector<Topic> topics() override {
    std::vector<Topic> all;
    for (const BagIndex::Connection& c : index_.connections)
      all.push_back({c.topic, printable(c.type), is_type<sensor_msgs::JointState>(c)});
    return all;
  }

  std::string expected_type() const override { return "sensor_msgs/JointState"; }

  std::size_t expected(const std::string& topic) const override {
    std::set<std::uint32_t> ids;
    for (const BagIndex::Connection& c : index_.connections)
      if (c.topic == topic) ids.insert(c.id);
    std::size_t count = 0;
    for (const BagIndex::Chunk& chunk : index_.chunks)
      for (const BagIndex::Entry& entry : chunk.entries) count += ids.count(entry.connection);
    return count;
  }

  std::optional<std::string> info() override {
    std::set<std::uint32_t> ids;
    for (const BagIndex::Connection& c : index_.connections) {
      if (c.topic != kInfoTopic) continue;
      if (!is_type<std_msgs::String>(c)) return std::nullopt;  // somebody else's topic
      ids.insert(c.id);
    }
    const BagIndex::Chunk* chunk = nullptr;
    const BagIndex::Entry* first = nullptr;
    for (const BagIndex::Chunk& each : index_.chunks)
      for (const BagIndex::Entry& entry : each.entries)
        if (ids.count(entry.connection) > 0 && (first == nullptr || entry.received < first->received))
          chunk = &each, first = &entry;
    if (first == nullptr) return std::nullopt;
    const std::string records = records_of_bag_chunk(path_, chunk->place);
    std::string_view message, text;
    if (!find_message(records, first->offset, message) || !bag_format::take_part(message, text))
      throw BadData(path_, "damaged bag: the message on " + kInfoTopic + " is not where the index says");
    return std::string(text);
  }

  void read(const std::vector<std::string>& topics, const Take& take) override {
    struct Wanted {
      const std::string* topic;
      JointStateDecoder decoder;
    };
    std::map<std::uint32_t, Wanted> wanted;
    std::set<std::uint32_t> ids;
    for (const BagIndex::Connection& c : index_.connections)
      if (std::find(topics.begin(), topics.end(), c.topic) != topics.end() && ids.insert(c.id).second)
        wanted[c.id].topic = &c.topic;
    std::size_t count = 0;
    BagDelivery delivery(index_, ids, [&](std::uint32_t connection, std::string_view message) {
      Wanted& from = wanted.at(connection);
      if (!from.decoder.decode(message))
        throw BadData(fmt::format("{}: {} message {}", path_, printable(*from.topic), count),
                      "damaged: its arrays do not fit into it");
      ++count;
      take(from.decoder.message(), *from.topic);
    });
    damage_ = walk_bag(path_, [&delivery](std::uint64_t place, std::string_view records) {
      return delivery.add(place, records);
    });
    delivery.finish();
  }

 private:
  const std::string path_;
  const BagIndex index_;
  std::string damage_;  // that the last read met
};

}  // namespace

const std::string kInfoTopic = "/record_info";

std::unique_ptr<MessageSource> open_bag(const std::string& path) {
  return std::make_unique<BagSource>(path);
}

}  // namespace backlash::ros_bridge
