#include "backlash_diagnosis/ros/bag_record.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "bag_structure.h"

namespace backlash {
namespace {

const std::string kInfoTopic = "/record_info";

std::string type_of(const rosbag::ConnectionInfo& c) {
  return printable(c.datatype);
}

template <typename Message>
bool is_type(const rosbag::ConnectionInfo& c) {
  return c.datatype == ros::message_traits::DataType<Message>::value() &&
         c.md5sum == ros::message_traits::MD5Sum<Message>::value();
}

std::string stamp_text(const ros::Time& stamp) {
  std::string nanoseconds = std::to_string(stamp.nsec);
  return std::to_string(stamp.sec) + "." +
         std::string(9 - std::min<std::size_t>(9, nanoseconds.size()), '0') + nanoseconds;
}

/// "joint_states" stands for "/joint_states" and "/robot/joint_states".
bool topic_matches(const std::string& topic, const std::string& wanted) {
  const auto bare = [](const std::string& name) {
    return name.substr(std::min(name.find_first_not_of('/'), name.size()));
  };
  const std::string a = bare(topic), b = bare(wanted);
  return a == b ||
         (a.size() > b.size() && a.compare(a.size() - b.size() - 1, std::string::npos, "/" + b) == 0);
}

/// The prefix of a name that belongs to a geared joint.
std::optional<std::string> joint_of(const std::string& name) {
  for (const std::string suffix : {"_motor", "_sensor", "_load", "_current", "_accelerometer"})
    if (name.size() > suffix.size() &&
        name.compare(name.size() - suffix.size(), std::string::npos, suffix) == 0)
      return name.substr(0, name.size() - suffix.size());
  return std::nullopt;
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

/// One joint of one bag.
class Reader {
 public:
  Reader(const std::string& path, const std::string& joint, const std::string& topic)
      : path_(path), joint_(joint), wanted_topic_(topic) {
    record_.name = path;
  }

  Record read() {
    check_bag_structure(path_);
    try {
      bag_.open(path_, rosbag::bagmode::Read);
      choose_topic();
      read_origin();
      read_messages();
    } catch (const Error&) {
      throw;
    } catch (const std::exception& e) {
      throw BadData(path_,
                    std::string("damaged bag: ") + e.what() + "; 'rosbag reindex' may save a part of it");
    }
    drop_absent_channels();
    const std::string repeated = stamps_.describe("topic " + topic_);
    if (!repeated.empty()) record_.warnings.push_back(repeated);
    for (std::string& warning : describe_time_base(record_.time))
      record_.warnings.push_back(std::move(warning));
    return std::move(record_);
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const { throw BadData(path_, reason); }

  [[noreturn]] void fail_at(std::size_t index, const std::string& reason) const {
    throw BadData(path_ + ": " + printable(topic_) + " message " + std::to_string(index), reason);
  }

  /// Calls `use(message, index)` for the messages of some topics in the order of the bag.
  template <typename Use>
  void for_each(const std::vector<std::string>& topics, const Use& use) {
    rosbag::View view(bag_, rosbag::TopicQuery(topics));
    std::size_t index = 0;
    std::vector<std::uint8_t> bytes;
    for (const rosbag::MessageInstance& instance : view) {
      bytes.resize(instance.size());
      ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
      instance.write(out);
      if (!lengths_fit(bytes))
        throw BadData(path_ + ": " + printable(instance.getTopic()) + " message " + std::to_string(index),
                      "damaged: its arrays do not fit into it");
      ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
      sensor_msgs::JointState message;
      ros::serialization::deserialize(in, message);
      use(message, index++, instance.getTopic());
    }
  }

  std::vector<std::string> candidate_topics() {
    rosbag::View all(bag_);
    std::set<std::string> topics, present;
    for (const rosbag::ConnectionInfo* c : all.getConnections()) {
      present.insert(printable(c->topic) + " (" + type_of(*c) + ")");
      if (!topic_matches(c->topic, wanted_topic_)) continue;
      if (!is_type<sensor_msgs::JointState>(*c))
        fail("topic " + printable(c->topic) + " is of type " + type_of(*c) +
             ", expected sensor_msgs/JointState");
      topics.insert(c->topic);
    }
    if (topics.empty())
      fail("no topic " + printable(wanted_topic_) +
           "; there are: " + (present.empty() ? "none" : joined(present)));
    return {topics.begin(), topics.end()};
  }

  /// Finds the joint (where not given) and its only topic.
  void choose_topic() {
    std::map<std::string, std::set<std::string>> topics_of_joint;
    std::set<std::string> names;
    const std::vector<std::string> candidates = candidate_topics();
    for_each(candidates, [&](const sensor_msgs::JointState& m, std::size_t, const std::string& topic) {
      for (const std::string& name : m.name) {
        if (!names.insert(topic + " " + name).second) continue;
        if (const auto joint = joint_of(name)) topics_of_joint[*joint].insert(topic);
      }
    });
    std::vector<std::string> joints;
    for (const auto& [joint, topics] : topics_of_joint) joints.push_back(printable(joint));
    if (joints.empty())
      fail("no joint on " + joined(candidates) +
           ": expected names like 'joint_motor', 'joint_sensor' or 'joint_load'");
    if (joint_.empty() && joints.size() > 1)
      fail("several joints, choose one with --joint: " + joined(joints));
    if (joint_.empty()) joint_ = topics_of_joint.begin()->first;
    const auto found = topics_of_joint.find(joint_);
    if (found == topics_of_joint.end())
      fail("no joint '" + printable(joint_) + "'; there are (--joint): " + joined(joints));
    if (found->second.size() > 1)
      fail("joint '" + printable(joint_) +
           "' is on several topics, choose one with --topic: " + joined(found->second));
    topic_ = *found->second.begin();
  }

  void read_origin() {
    rosbag::View all(bag_);
    for (const rosbag::ConnectionInfo* c : all.getConnections())
      if (c->topic == kInfoTopic && !is_type<std_msgs::String>(*c)) return;  // somebody else's topic
    rosbag::View view(bag_, rosbag::TopicQuery(kInfoTopic));
    if (view.begin() == view.end()) return;
    const auto message = view.begin()->instantiate<std_msgs::String>();
    if (!message) return;
    const YamlReader yaml = YamlReader::from_text(message->data, path_ + ": " + kInfoTopic);
    yaml.text("name");
    const YamlReader stamp = yaml.map("time_origin");
    origin_ = ros::Time(
        static_cast<std::uint32_t>(stamp.integer("secs", 0, std::numeric_limits<std::uint32_t>::max())),
        static_cast<std::uint32_t>(stamp.integer("nsecs", 0, 999'999'999)));
    yaml.finish();
  }

  void read_messages() {
    const JointNames names(joint_);
    for_each({topic_}, [&](const sensor_msgs::JointState& m, std::size_t index, const std::string&) {
      if (!mentions(m, names)) return;
      const std::string place = path_ + ": " + printable(topic_) + " message " + std::to_string(index);
      const ChannelValues values = read_joint_state(m, names, place);
      if (!accept_stamp(m.header.stamp, index)) return;
      for (const Channel channel : kChannels)
        add(channel, values[static_cast<std::size_t>(channel)], m, index);
    });
    if (record_.time.empty()) fail("no message of joint '" + printable(joint_) + "' on " + printable(topic_));
  }

  bool accept_stamp(const ros::Time& stamp, std::size_t index) {
    if (stamp.isZero()) fail_at(index, "header.stamp = 0: the publisher does not stamp its messages");
    if (record_.time.empty() && stamps_.accepted() == 0) {
      first_ = stamp;
      clock_.seconds(origin_.value_or(stamp));  // time 0
    }
    switch (stamps_.next(since_first(stamp))) {
      case StampVerdict::accept:
        break;
      case StampVerdict::repeated:
        return false;
      case StampVerdict::backwards:
        fail_at(index, "header.stamp = " + stamp_text(stamp) + " s is before " + stamp_text(last_stamp_) +
                           " s of the message before: a looped or merged recording, or a clock that jumped");
    }
    last_stamp_ = stamp;
    record_.time.push_back(clock_.seconds(stamp));
    return true;
  }

  double since_first(const ros::Time& stamp) const {
    StampClock clock;
    clock.seconds(first_);
    return clock.seconds(stamp);
  }

  /// A channel is there in all messages or in none.
  void add(Channel channel, double value, const sensor_msgs::JointState& m, std::size_t index) {
    std::vector<double>& column = record_.column(channel);
    if (!column.empty() && std::isnan(column.front()) != std::isnan(value))
      fail_at(index, channel_name(channel) + " of joint '" + printable(joint_) + "' at stamp " +
                         stamp_text(m.header.stamp) + " s is " +
                         (std::isnan(value) ? "missing or NaN" : "there") +
                         ", unlike in the messages before");
    column.push_back(value);
  }

  void drop_absent_channels() {
    std::vector<std::string> present;
    for (const Channel channel : kChannels) {
      std::vector<double>& column = record_.column(channel);
      if (!column.empty() && std::isnan(column.front())) column.clear();
      if (!column.empty()) present.push_back(channel_name(channel));
    }
    if (!record_.tells())
      fail("joint '" + printable(joint_) + "' on " + printable(topic_) +
           " has no torque, position, current or acceleration; it has: " + (present.empty() ? "nothing" : joined(present)));
  }

  const std::string path_;
  std::string joint_;
  const std::string wanted_topic_;
  std::string topic_;
  rosbag::Bag bag_;
  std::optional<ros::Time> origin_;
  ros::Time first_, last_stamp_;
  StampClock clock_;
  StampChecker stamps_;
  Record record_;
};

}  // namespace

const ros::Time kBagTimeOrigin(1'000'000'000, 0);

Record read_bag(const std::string& path, const std::string& joint, const std::string& topic) {
  return Reader(path, joint, topic).read();
}

}  // namespace backlash
