// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/bag_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "backlash_diagnosis/record/sample_joiner.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/recording/recording.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "message_source.h"

namespace backlash::ros_bridge {
namespace {

std::string stamp_text(const ros::Time& stamp) {
  return fmt::format("{}.{:09}", stamp.sec, stamp.nsec);
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

/// A joint of a topic, message by message.
class JointRun {
 public:
  /// `expected`: messages, about.
  JointRun(std::string path, std::string topic, std::string joint, std::optional<ros::Time> origin,
           std::size_t expected)
      : path_(std::move(path)),
        topic_(std::move(topic)),
        joint_(std::move(joint)),
        origin_(origin),
        expected_(expected) {
    record_.name = path_;
  }

  const std::string& topic() const { return topic_; }

  /// Throws BadData; the caller keeps it until it is known that this joint is wanted.
  void take(const JointStateReader& reader, std::size_t place, const ros::Time& stamp, std::size_t index) {
    if (!reader.problem(place).empty()) fail_at(index, reader.problem(place));
    if (!accept_stamp(stamp, index)) return;
    if (record_.time.size() == 1) record_.time.reserve(expected_);
    for (const record::Channel channel : record::kChannels) {
      std::vector<double>& column = record_.column(channel);
      const double value = reader.values(place)[static_cast<std::size_t>(channel)];
      if (column.empty() && std::isnan(value)) continue;  // absent until it turns up
      if (column.empty()) {
        column.reserve(expected_);
        column.resize(record_.size() - 1, std::numeric_limits<double>::quiet_NaN());
      }
      column.push_back(value);
    }
  }

  record::Record finished() {
    if (record_.time.empty())
      throw BadData(path_, "no message of joint '" + printable(joint_) + "' on " + printable(topic_));
    record::Record record = with_warnings();
    require_a_channel(record);
    return record;
  }

  /// Of a channel map: what this topic has of it.
  record::Record finished(const record::ChannelMap& sources) {
    for (const record::ChannelSource& source : sources.sources) {
      if (record_.column(source.channel).empty() && !source.optional)
        throw BadData(path_, fmt::format("channels.{}: no message on {} has the {} of '{}'",
                                         record::channel_name(source.channel), printable(topic_),
                                         record::field_name(source.field), printable(source.name)));
    }
    return with_warnings();
  }

  std::exception_ptr wrong;  // with a message of it

 private:
  record::Record with_warnings() {
    const std::string repeated = stamps_.describe("topic " + topic_);
    if (!repeated.empty()) record_.warnings.push_back(repeated);
    stamps_.count_into(record_);
    for (std::string& warning : record::describe_time_base(record_.time))
      record_.warnings.push_back(std::move(warning));
    return std::move(record_);
  }

  [[noreturn]] void fail_at(std::size_t index, const std::string& reason) const {
    throw BadData(fmt::format("{}: {} message {}", path_, printable(topic_), index), reason);
  }

  bool accept_stamp(const ros::Time& stamp, std::size_t index) {
    if (stamp.isZero()) fail_at(index, "header.stamp = 0: the publisher does not stamp its messages");
    if (record_.time.empty() && stamps_.accepted() == 0) {
      since_first_.seconds(stamp);
      clock_.seconds(origin_.value_or(stamp));  // time 0
      record_.origin = origin_.value_or(stamp).toSec();
    }
    switch (stamps_.next(since_first_.seconds(stamp))) {
      case record::StampVerdict::accept:
        break;
      case record::StampVerdict::repeated:
        return false;
      case record::StampVerdict::backwards:
        if (stamps_.resume(since_first_.seconds(stamp))) break;
        fail_at(index, "header.stamp = " + stamp_text(stamp) + " s is before " + stamp_text(last_stamp_) +
                           " s of the message before: several publishers, or a merged recording");
    }
    last_stamp_ = stamp;
    record_.time.push_back(clock_.seconds(stamp) + stamps_.offset());
    return true;
  }

  void require_a_channel(const record::Record& record) const {
    std::vector<std::string> present;
    for (const record::Channel channel : record::kChannels)
      if (record.has(channel)) present.push_back(record::channel_name(channel));
    if (!record.can_show_backlash())
      throw BadData(path_,
                    "joint '" + printable(joint_) + "' on " + printable(topic_) +
                        " has no torque, position, speed of the motor, current or acceleration; it has: " +
                        (present.empty() ? "nothing" : joined(present)));
  }

  std::string path_, topic_, joint_;
  std::optional<ros::Time> origin_;
  std::size_t expected_;
  ros::Time last_stamp_;
  StampClock clock_, since_first_;
  record::StampChecker stamps_;
  record::Record record_;
};

/// All joints of a topic, as their names turn up.
struct TopicRuns {
  std::set<std::string> names;
  std::vector<std::string> last_names;  // of the message before
  std::vector<std::string> joints;
  std::vector<JointRun> runs;
  JointStateReader reader{std::vector<record::ChannelMap>()};
  std::size_t messages = 0;
};

/// One joint of one bag, in one pass over its messages.
class Reader {
 public:
  Reader(const std::string& path, const std::string& joint, const std::string& topic)
      : path_(path),
        joint_(joint),
        wanted_topic_(topic),
        source_(recording::is_recording(path) ? open_ros2_recording(path) : open_bag(path)) {}

  record::Record read() {
    return of_sound_file([this] { return with_own_names(joint_); });
  }

  record::Record read(const record::ChannelMap& map) {
    return of_sound_file([&] { return origin_ ? with_own_names(map.joint) : with_map(map); });
  }

  record::Record read_of_robot(const record::ChannelMap& stock) {
    return of_sound_file([&] {
      joint_ = stock.joint;
      const std::vector<std::string> topics = candidate_topics(wanted_topic_);
      read_messages(topics);
      if (origin_ || any_has(JointNames(joint_).motor)) return finished(topics);
      topics_.clear();
      return with_map(stock);
    });
  }

 private:
  /// Damage is reported before what is missing: it may be the cause.
  template <typename Read>
  record::Record of_sound_file(const Read& read) {
    try {
      read_origin();
      return read();
    } catch (const Error&) {
      source_->check();
      throw;
    }
  }

  [[noreturn]] void fail(const std::string& reason) const { throw BadData(path_, reason); }

  record::Record with_map(const record::ChannelMap& map) {
    std::vector<std::string> topics;
    for (const std::string& wanted : map.topics()) {
      const std::vector<std::string> found = candidate_topics(wanted);
      if (found.size() > 1)
        fail("channels: several topics end in " + printable(wanted) + ", name one whole: " + joined(found));
      topics.push_back(found.front());
    }
    if (topics.size() > 1) origin_ = first_stamp(topics);
    for (std::size_t i = 0; i < topics.size(); ++i) meet(map.on(map.topics()[i]), topics[i]);
    mapped_ = true;
    read_messages(topics);
    return with_warnings(joined_parts(map, topics));
  }

  /// By the names of this package.
  record::Record with_own_names(const std::string& joint) {
    joint_ = joint;
    const std::vector<std::string> topics = candidate_topics(wanted_topic_);
    read_messages(topics);
    return finished(topics);
  }

  record::Record finished(const std::vector<std::string>& topics) {
    JointRun& run = chosen(topics);
    if (run.wrong) std::rethrow_exception(run.wrong);
    return with_warnings(run.finished());
  }

  bool any_has(const std::string& name) const {
    return std::any_of(topics_.begin(), topics_.end(),
                       [&name](const auto& topic) { return topic.second.names.count(name) > 0; });
  }

  record::Record with_warnings(record::Record record) const {
    for (std::string& warning : source_->warnings()) record.warnings.push_back(std::move(warning));
    return record;
  }

  std::vector<std::string> candidate_topics(const std::string& wanted) {
    std::set<std::string> topics, present;
    for (const MessageSource::Topic& topic : source_->topics()) {
      present.insert(printable(topic.name) + " (" + topic.type + ")");
      if (!topic_matches(topic.name, wanted)) continue;
      if (!topic.joint_states)
        fail("topic " + printable(topic.name) + " is of type " + topic.type + ", expected " +
             source_->expected_type());
      topics.insert(topic.name);
    }
    if (topics.empty())
      fail("no topic " + printable(wanted) + "; there are: " + (present.empty() ? "none" : joined(present)));
    return {topics.begin(), topics.end()};
  }

  void read_origin() {
    const std::optional<std::string> text = source_->info();
    if (!text) return;
    const YamlReader yaml = YamlReader::from_text(*text, path_ + ": " + kInfoTopic);
    yaml.text("name");
    const YamlReader stamp = yaml.map("time_origin");
    origin_ = ros::Time(
        static_cast<std::uint32_t>(stamp.integer("secs", 0, std::numeric_limits<std::uint32_t>::max())),
        static_cast<std::uint32_t>(stamp.integer("nsecs", 0, 999'999'999)));
    yaml.finish();
  }

  void read_messages(const std::vector<std::string>& topics) {
    source_->read(topics, [this](const sensor_msgs::JointState& message, const std::string& topic) {
      take(message, topic);
    });
  }

  void take(const sensor_msgs::JointState& message, const std::string& topic) {
    TopicRuns& on = topics_[topic];
    if (message.name != on.last_names) {
      on.last_names = message.name;
      for (const std::string& name : message.name)
        if (on.names.insert(name).second && !mapped_) meet(name, topic, on);
    }
    const std::size_t index = on.messages++;
    for (const std::size_t place : on.reader.read(message)) {
      JointRun& run = on.runs[place];
      const bool wanted = mapped_ || (joint_.empty() ? joints_.size() == 1 : on.joints[place] == joint_);
      if (run.wrong || !wanted) continue;
      try {
        run.take(on.reader, place, message.header.stamp, index);
      } catch (const BadData&) {
        run.wrong = std::current_exception();
      }
    }
  }

  /// A name that was not there before may be that of another joint.
  void meet(const std::string& name, const std::string& topic, TopicRuns& on) {
    const auto joint = joint_of(name);
    if (!joint || std::find(on.joints.begin(), on.joints.end(), *joint) != on.joints.end()) return;
    joints_.insert(*joint);
    on.joints.push_back(*joint);
    on.runs.emplace_back(path_, topic, *joint, origin_, source_->expected(topic));
    std::vector<record::ChannelMap> maps;
    for (const std::string& each : on.joints) maps.push_back(record::usual_channels(each));
    on.reader = JointStateReader(maps);
  }

  void meet(const record::ChannelMap& sources, const std::string& topic) {
    TopicRuns& on = topics_[topic];
    on.joints = {sources.joint};
    on.runs.emplace_back(path_, topic, sources.joint, origin_, source_->expected(topic));
    on.reader = JointStateReader({sources});
  }

  /// Time 0 of all topics.
  ros::Time first_stamp(const std::vector<std::string>& topics) {
    std::optional<ros::Time> first;
    source_->read(topics, [&first](const sensor_msgs::JointState& message, const std::string&) {
      if (!first) first = message.header.stamp;
    });
    if (first) return *first;
    fail("no message on " + joined(topics));
  }

  /// Of one topic of a map.
  record::Record part(const record::ChannelMap& sources, const std::string& topic) {
    TopicRuns& on = topics_[topic];
    JointRun& run = on.runs.front();
    if (run.wrong) std::rethrow_exception(run.wrong);
    std::vector<std::string> names;
    for (const std::string& name : on.names) names.push_back(printable(name));
    for (const record::ChannelSource& source : sources.sources)
      if (on.names.count(source.name) == 0)
        fail(fmt::format("channels.{}: no '{}' on {}; there are: {}", record::channel_name(source.channel),
                         printable(source.name), printable(topic), names.empty() ? "none" : joined(names)));
    return run.finished(sources);
  }

  record::Record joined_parts(const record::ChannelMap& map, const std::vector<std::string>& topics) {
    std::vector<record::Record> parts;
    for (std::size_t i = 0; i < topics.size(); ++i) parts.push_back(part(map.on(map.topics()[i]), topics[i]));
    if (parts.size() == 1) return std::move(parts.front());
    try {
      return record::joined(parts);
    } catch (const BadData& error) {
      fail(std::string("channels: ") + error.what());
    }
  }

  /// The joint that was asked for, or the only one; on its only topic.
  JointRun& chosen(const std::vector<std::string>& topics) {
    std::vector<std::string> joints;
    for (const std::string& joint : joints_) joints.push_back(printable(joint));
    if (joints.empty())
      fail("no joint on " + joined(topics) +
           ": expected names like 'joint_motor', 'joint_sensor' or 'joint_load'");
    if (joint_.empty() && joints.size() > 1)
      fail("several joints, choose one with --joint: " + joined(joints));
    if (joint_.empty()) joint_ = *joints_.begin();
    std::vector<JointRun*> found;
    std::vector<std::string> where;
    for (auto& [topic, on] : topics_)
      for (std::size_t i = 0; i < on.joints.size(); ++i) {
        if (on.joints[i] != joint_) continue;
        found.push_back(&on.runs[i]);
        where.push_back(topic);
      }
    if (found.empty()) fail("no joint '" + printable(joint_) + "'; there are (--joint): " + joined(joints));
    if (found.size() > 1)
      fail("joint '" + printable(joint_) +
           "' is on several topics, choose one with --topic: " + joined(where));
    return *found.front();
  }

  const std::string path_;
  std::string joint_;
  const std::string wanted_topic_;
  std::unique_ptr<MessageSource> source_;
  std::optional<ros::Time> origin_;
  std::set<std::string> joints_;
  std::map<std::string, TopicRuns> topics_;
  bool mapped_ = false;  // by a channel map, not by names
};

}  // namespace

const ros::Time kBagTimeOrigin(1'000'000'000, 0);

record::Record read_bag(const std::string& path, const std::string& joint, const std::string& topic) {
  return Reader(path, joint, topic).read();
}

record::Record read_bag(const std::string& path, const record::ChannelMap& channels) {
  return channels.declared ? Reader(path, "", "joint_states").read(channels) : read_bag(path, channels.joint);
}

record::Record read_robot_bag(const std::string& path, const record::ChannelMap& stock) {
  return Reader(path, "", "joint_states").read_of_robot(stock);
}

}  // namespace backlash::ros_bridge
