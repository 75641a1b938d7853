// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/String.h>

#include <cstring>
#include <exception>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "bag_structure.h"
#include "message_source.h"

namespace backlash::ros_bridge {
namespace {

template <typename Message>
bool is_type(const rosbag::ConnectionInfo& c) {
  return c.datatype == ros::message_traits::DataType<Message>::value() &&
         c.md5sum == ros::message_traits::MD5Sum<Message>::value();
}

/// Lengths of a serialised JointState: a damaged one would make the deserialiser reserve what it asks for.
bool lengths_fit(const std::vector<std::uint8_t>& bytes) {
  std::size_t place = 12;  // sequence number, stamp
  const auto array = [&](std::size_t item, std::uint32_t& count) {
    if (place + 4 > bytes.size()) return false;
    std::memcpy(&count, bytes.data() + place, 4);
    place += 4;
    if (std::uint64_t{count} * item > bytes.size() - place) return false;
    place += count * item;
    return true;
  };
  std::uint32_t count = 0, names = 0, ignored = 0;
  if (!array(1, count)) return false;  // frame_id
  if (place + 4 > bytes.size()) return false;
  std::memcpy(&names, bytes.data() + place, 4);
  place += 4;
  if (names > (bytes.size() - place) / 4) return false;
  for (std::uint32_t i = 0; i < names; ++i)
    if (!array(1, ignored)) return false;
  for (int i = 0; i < 3; ++i)
    if (!array(sizeof(double), ignored)) return false;
  return place == bytes.size();
}

/// Takes a message's bytes as they lie in the bag. MessageInstance::write asks a stream for no more than
/// this; to ask the instance for its size before would read its header twice.
struct RawMessage {
  std::vector<std::uint8_t> bytes;
  std::uint8_t* advance(std::uint32_t size) {
    bytes.resize(size);
    return bytes.data();
  }
};

class BagSource : public MessageSource {
 public:
  explicit BagSource(const std::string& path) : path_(path) {
    check_bag_structure(path_);
    guarded([this] { bag_.open(path_, rosbag::bagmode::Read); });
  }

  std::vector<Topic> topics() override {
    std::vector<Topic> all;
    guarded([&] {
      rosbag::View view(bag_);
      for (const rosbag::ConnectionInfo* c : view.getConnections())
        all.push_back({c->topic, printable(c->datatype), is_type<sensor_msgs::JointState>(*c)});
    });
    return all;
  }

  std::string expected_type() const override { return "sensor_msgs/JointState"; }

  std::optional<std::string> info() override {
    std::optional<std::string> text;
    guarded([&] {
      rosbag::View all(bag_);
      for (const rosbag::ConnectionInfo* c : all.getConnections())
        if (c->topic == kInfoTopic && !is_type<std_msgs::String>(*c)) return;  // somebody else's topic
      rosbag::View view(bag_, rosbag::TopicQuery(kInfoTopic));
      if (view.begin() == view.end()) return;
      if (const auto message = view.begin()->instantiate<std_msgs::String>()) text = message->data;
    });
    return text;
  }

  void read(const std::vector<std::string>& topics, const Take& take) override {
    guarded([&] {
      rosbag::View view(bag_, rosbag::TopicQuery(topics));
      std::size_t index = 0;
      RawMessage raw;
      sensor_msgs::JointState message;  // one for all: its arrays keep their room
      for (const rosbag::MessageInstance& instance : view) {
        raw.bytes.clear();  // an empty message asks for nothing
        instance.write(raw);
        if (!lengths_fit(raw.bytes))
          throw BadData(fmt::format("{}: {} message {}", path_, printable(instance.getTopic()), index),
                        "damaged: its arrays do not fit into it");
        ros::serialization::IStream in(raw.bytes.data(), static_cast<std::uint32_t>(raw.bytes.size()));
        ros::serialization::deserialize(in, message);
        ++index;
        take(message, instance.getTopic());
      }
    });
  }

 private:
  template <typename Action>
  void guarded(const Action& action) {
    try {
      action();
    } catch (const Error&) {
      throw;
    } catch (const std::exception& e) {
      throw BadData(path_,
                    std::string("damaged bag: ") + e.what() + "; 'rosbag reindex' may save a part of it");
    }
  }

  const std::string path_;
  rosbag::Bag bag_;
};

}  // namespace

const std::string kInfoTopic = "/record_info";

std::unique_ptr<MessageSource> open_bag(const std::string& path) {
  return std::make_unique<BagSource>(path);
}

}  // namespace backlash::ros_bridge
