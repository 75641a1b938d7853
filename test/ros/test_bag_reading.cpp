// SPDX-License-Identifier: BSD-3-Clause
// What is read of a bag against what rosbag's own View and deserialiser give of it.
#include <gtest/gtest.h>
#include <ros/serialization.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <random>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "ros/serialised_joint_state.h"

namespace backlash::ros_bridge {
namespace {

namespace fs = std::filesystem;
using Compression = rosbag::compression::CompressionType;

const std::string kTopic = "/arm/joint_states";

/// The message of a bag that is received `k`-th. Names come in two orders, with names of others among them,
/// and as many values as the array has at all.
sensor_msgs::JointState message_of(unsigned k, bool effort) {
  sensor_msgs::JointState m;
  m.header.stamp = ros::Time(100 + k / 100, (k % 100) * 10'000'000 + 7);
  m.header.frame_id = k % 3 == 0 ? "" : "base";
  m.name = {"elbow_motor", "elbow_load", "stranger"};
  m.position = {0.1 * k, 0.1 * k - 3, 9};
  m.velocity = {-1.0 * k, 1, 8};
  if (effort) m.effort = {std::sin(k), -std::sin(k), 7};
  if (k % 5 != 0) return m;
  for (auto* values : {&m.position, &m.velocity, &m.effort}) std::reverse(values->begin(), values->end());
  std::reverse(m.name.begin(), m.name.end());
  return m;
}

boost::shared_ptr<ros::M_string> publisher(const std::string& name, bool latched) {
  auto header = boost::make_shared<ros::M_string>();
  using Message = sensor_msgs::JointState;
  (*header)["type"] = ros::message_traits::DataType<Message>::value();
  (*header)["md5sum"] = ros::message_traits::MD5Sum<Message>::value();
  (*header)["message_definition"] = ros::message_traits::Definition<Message>::value();
  (*header)["callerid"] = name;
  (*header)["latching"] = latched ? "1" : "0";
  return header;
}

class BagReading : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::path(testing::TempDir()) / "bag_reading_XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path() const { return (folder_ / "a.bag").string(); }

  /// Messages are written in this order and received in their own: two publishers on the topic, and others'
  /// topics.
  void write(const std::vector<unsigned>& order, Compression compression, std::uint32_t chunk,
             bool effort = true) const {
    rosbag::Bag bag(path(), rosbag::bagmode::Write);
    bag.setCompression(compression);
    bag.setChunkThreshold(chunk);
    const auto one = publisher("/one", false), two = publisher("/two", true);
    std_msgs::String text;
    text.data = std::string(300, 'x');
    for (const unsigned k : order) {
      const sensor_msgs::JointState m = message_of(k, effort);
      bag.write(kTopic, m.header.stamp + ros::Duration(50), m, k % 4 == 0 ? two : one);
      if (k % 7 == 0) bag.write("/chatter", m.header.stamp, text);
      if (k % 2 == 0) bag.write("/other/joint_states", m.header.stamp, message_of(k + 1, effort));
    }
    bag.close();
  }

  void expect_as_the_library_reads_it(std::size_t count) const {
    record::Record expected;
    rosbag::Bag bag(path());
    rosbag::View view(bag, rosbag::TopicQuery(kTopic));
    std::optional<ros::Time> first;
    for (const rosbag::MessageInstance& instance : view) {
      const auto m = instance.instantiate<sensor_msgs::JointState>();
      if (!first) first = m->header.stamp;
      expected.time.push_back(double((m->header.stamp - *first).toNSec()) / 1e9);
      for (std::size_t i = 0; i < m->name.size(); ++i) {
        using record::Channel;
        const bool motor = m->name[i] == "elbow_motor";
        if (!motor && m->name[i] != "elbow_load") continue;
        expected.column(motor ? Channel::motor_position : Channel::load_position).push_back(m->position[i]);
        expected.column(motor ? Channel::motor_velocity : Channel::load_velocity).push_back(m->velocity[i]);
        if (!m->effort.empty())
          expected.column(motor ? Channel::motor_torque : Channel::output_torque).push_back(m->effort[i]);
      }
    }
    ASSERT_EQ(expected.size(), count);
    const record::Record read = read_bag(path(), "elbow", kTopic);
    EXPECT_EQ(read.time, expected.time);
    EXPECT_TRUE(read.warnings.empty());
    for (const record::Channel channel : record::kChannels)
      EXPECT_EQ(read.column(channel), expected.column(channel)) << record::channel_name(channel);
  }

  std::string refusal(const std::string& topic) const {
    try {
      read_bag(path(), "", topic);
    } catch (const BadData& e) {
      return e.what();
    }
    ADD_FAILURE() << "not refused";
    return "";
  }

  std::string bytes() const {
    std::ifstream in(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  void overwrite(const std::string& bytes) const { std::ofstream(path(), std::ios::binary) << bytes; }

  fs::path folder_;
};

std::vector<unsigned> in_order(unsigned count) {
  std::vector<unsigned> order(count);
  std::iota(order.begin(), order.end(), 0);
  return order;
}

TEST_F(BagReading, IsThatOfTheLibraryWhateverTheCompressionAndTheChunks) {
  for (const Compression compression :
       {rosbag::compression::Uncompressed, rosbag::compression::BZ2, rosbag::compression::LZ4})
    for (const std::uint32_t chunk : {1u, 3000u, 100'000'000u})
      for (const bool effort : {true, false}) {
        SCOPED_TRACE(testing::Message() << compression << ", chunks of " << chunk << ", effort " << effort);
        write(in_order(300), compression, chunk, effort);
        expect_as_the_library_reads_it(300);
      }
}

/// As in merged bags and where clocks jumped: what lies later in the file was received before.
TEST_F(BagReading, IsInTheOrderOfReceiptWhateverTheOrderInTheFile) {
  std::vector<std::vector<unsigned>> orders(3, in_order(300));
  std::reverse(orders[0].begin(), orders[0].end());
  std::stable_partition(orders[1].begin(), orders[1].end(), [](unsigned k) { return k % 3 == 0; });
  std::shuffle(orders[2].begin() + 40, orders[2].begin() + 260, std::mt19937(1));
  for (const std::vector<unsigned>& order : orders)
    for (const Compression compression : {rosbag::compression::Uncompressed, rosbag::compression::LZ4}) {
      SCOPED_TRACE(testing::Message() << order.front() << ", " << order[1] << ": " << compression);
      write(order, compression, 3000);
      expect_as_the_library_reads_it(300);
    }
}

TEST_F(BagReading, DamageIsReportedBeforeWhatIsMissing) {
  write(in_order(300), rosbag::compression::LZ4, 3000);
  EXPECT_NE(refusal("/nowhere").find("no topic"), std::string::npos);
  std::string damaged = bytes();
  std::uint64_t index = 0;
  std::memcpy(&index, damaged.data() + damaged.find("index_pos=") + 10, sizeof index);
  const auto last = damaged.rfind("compression=lz4", index);
  damaged[last + 100] = static_cast<char>(damaged[last + 100] ^ 0x10);
  overwrite(damaged);
  EXPECT_NE(refusal("/nowhere").find("damaged bag: a chunk cannot be unpacked"), std::string::npos)
      << refusal("/nowhere");
}

/// The header of an encrypted bag as rosbag writes it: one more field, taken from the padding behind it.
TEST_F(BagReading, AnEncryptedBagIsReportedAsThat) {
  write(in_order(10), rosbag::compression::Uncompressed, 3000);
  std::string changed = bytes();
  const std::size_t start = std::strlen("#ROSBAG V2.0\n");
  const std::string text = "encryptor=rosbag/AesCbcEncryptor";
  const auto put_number = [](std::uint32_t number) {
    return std::string(reinterpret_cast<const char*>(&number), sizeof number);
  };
  std::uint32_t header = 0, padding = 0;
  std::memcpy(&header, changed.data() + start, 4);
  std::memcpy(&padding, changed.data() + start + 4 + header, 4);
  const auto more = static_cast<std::uint32_t>(4 + text.size());
  changed.replace(start + 4 + header, 4 + more, put_number(more - 4) + text + put_number(padding - more));
  changed.replace(start, 4, put_number(header + more));
  overwrite(changed);
  EXPECT_NE(refusal(kTopic).find("an encrypted bag (by rosbag/AesCbcEncryptor)"), std::string::npos)
      << refusal(kTopic);
}

std::string serialised(const sensor_msgs::JointState& m) {
  std::string bytes(ros::serialization::serializationLength(m), '\0');
  ros::serialization::OStream out(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                  static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(out, m);
  return bytes;
}

TEST(SerialisedJointState, IsThatOfTheDeserialiser) {
  JointStateDecoder decoder;
  std::mt19937 random(1);
  const auto below = [&random](unsigned limit) { return random() % limit; };
  for (int trial = 0; trial < 2000; ++trial) {
    sensor_msgs::JointState m;
    m.header.seq = below(1000);
    m.header.stamp = ros::Time(below(2'000'000'000), below(1'000'000'000));
    m.header.frame_id = std::string(below(3), 'f');
    m.name.resize(below(4));
    for (std::string& name : m.name) name = std::string(below(3), static_cast<char>('a' + below(2)));
    for (auto* values : {&m.position, &m.velocity, &m.effort}) values->resize(below(4), 0.5 + below(9));
    const std::string bytes = serialised(m);
    ASSERT_TRUE(decoder.decode(bytes));
    EXPECT_EQ(decoder.message().header.stamp, m.header.stamp);
    EXPECT_EQ(decoder.message().name, m.name);
    EXPECT_EQ(decoder.message().position, m.position);
    EXPECT_EQ(decoder.message().velocity, m.velocity);
    EXPECT_EQ(decoder.message().effort, m.effort);
    if (trial % 4 != 0) continue;
    EXPECT_FALSE(decoder.decode(bytes + '\0'));
    EXPECT_FALSE(
        decoder.decode(std::string_view(bytes).substr(0, below(static_cast<unsigned>(bytes.size())))));
  }
}

}  // namespace
}  // namespace backlash::ros_bridge
