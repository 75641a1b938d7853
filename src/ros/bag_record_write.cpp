// SPDX-License-Identifier: BSD-3-Clause
// The writing half of bag_record.h.
#include <fcntl.h>
#include <fmt/format.h>
#include <rosbag/bag.h>
#include <std_msgs/String.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/recording/mcap_writer.h"
#include "backlash_diagnosis/ros/bag_record.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "message_source.h"

namespace backlash::ros_bridge {
namespace {

const std::string kJointTopic = "/joint_states";

/// A file beside the target that vanishes unless it is kept.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& path) : path_(path), target_(path) {
    struct stat existing {};
    if (::stat(path.c_str(), &existing) == 0) {
      if (!S_ISREG(existing.st_mode))
        fail(S_ISDIR(existing.st_mode) ? "is a directory" : "is not a regular file");
      std::error_code ignored;
      const auto real = std::filesystem::canonical(path, ignored);  // a symbolic link stays
      if (!ignored) target_ = real.string();
    }
    name_ = fmt::format("{}.tmp-{}", target_, ::getpid());
    const int descriptor = ::open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor < 0) fail(std::strerror(errno));
    ::close(descriptor);
  }
  ~TemporaryFile() {
    if (!kept_) ::unlink(name_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::string& name() const { return name_; }

  void keep() {
    const int descriptor = ::open(name_.c_str(), O_RDONLY | O_CLOEXEC);
    int error = descriptor < 0 || ::fsync(descriptor) != 0 ? errno : 0;
    if (descriptor >= 0) ::close(descriptor);
    if (error == 0 && ::rename(name_.c_str(), target_.c_str()) != 0) error = errno;
    if (error != 0) fail(std::strerror(error));
    kept_ = true;
  }

  [[noreturn]] void fail(const std::string& reason) const {
    throw CannotWrite(path_ + ": cannot be written: " + reason);
  }

 private:
  const std::string path_;
  std::string target_, name_;
  bool kept_ = false;
};

void check_writable(const record::Record& record) {
  const auto fail = [&record](const std::string& reason) { throw BadData(record.name, reason); };
  if (record.time.empty()) fail("a record without samples cannot be written");
  if (!record.can_show_backlash())
    fail("a record needs a torque, position, current or acceleration to be written");
  for (const record::Channel channel : record::kChannels) {
    const std::vector<double>& column = record.column(channel);
    if (column.empty()) continue;
    if (column.size() != record.size())
      fail(fmt::format("{} has {} values, time has {}", record::channel_name(channel), column.size(),
                       record.size()));
    for (std::size_t i = 0; i < column.size(); ++i)
      if (!std::isfinite(column[i]))
        fail(fmt::format("{} in sample {} is not a finite number", record::channel_name(channel), i));
  }
}

/// Stamps to the nanosecond, increasing and within what ROS can hold.
std::vector<ros::Time> stamps_of(const record::Record& record, const ros::Time& origin) {
  std::vector<ros::Time> stamps;
  stamps.reserve(record.size());
  for (std::size_t i = 0; i < record.size(); ++i) {
    const auto fail = [&](const char* reason) {
      throw BadData(record.name,
                    fmt::format("time = {} s in sample {}: {}", to_text(record.time[i]), i, reason));
    };
    if (!(std::abs(record.time[i]) < 4294967295.0)) fail("a ROS stamp cannot hold it");
    const double whole = std::floor(record.time[i]);
    const std::int64_t total = static_cast<std::int64_t>(origin.toNSec()) +
                               static_cast<std::int64_t>(whole) * 1'000'000'000 +
                               std::llround((record.time[i] - whole) * 1e9);
    if (total <= 0 || total / 1'000'000'000 > std::numeric_limits<std::uint32_t>::max())
      fail("a ROS stamp cannot hold it");
    ros::Time stamp;
    stamp.fromNSec(static_cast<std::uint64_t>(total));
    if (!stamps.empty() && !(stamp > stamps.back())) fail("does not increase by at least 1 ns");
    stamps.push_back(stamp);
  }
  return stamps;
}

/// That of all joints, whose times are the same.
const record::Record& time_base(const std::vector<record::JointRecord>& joints) {
  if (joints.empty()) throw InvalidParameter("joints", "none", "must be at least one");
  const record::Record& first = joints.front().record;
  for (const record::JointRecord& joint : joints) {
    if (joint.joint.empty()) throw InvalidParameter("joint", "''", "must not be empty");
    check_writable(joint.record);
    if (joint.record.time != first.time)
      throw BadData(joint.record.name, joint.joint + " and " + joints.front().joint + " have other times");
  }
  return first;
}

/// Makes the message of one sample of all joints.
class Messages {
 public:
  explicit Messages(const std::vector<record::JointRecord>& joints) : joints_(joints) {
    for (const record::JointRecord& joint : joints) names_.emplace_back(joint.joint);
  }

  sensor_msgs::JointState at(std::size_t i) const {
    sensor_msgs::JointState message;
    for (std::size_t j = 0; j < joints_.size(); ++j)
      add_joint_state(joints_[j].record, i, names_[j], message);
    empty_if_absent(message);
    return message;
  }

 private:
  const std::vector<record::JointRecord>& joints_;
  std::vector<JointNames> names_;
};

std_msgs::String info_message(const record::Record& record, const ros::Time& origin) {
  std::string name;
  for (const char c : printable(record.name, 4096)) {
    if (c == '"' || c == '\\') name += '\\';
    name += c;
  }
  std_msgs::String message;
  message.data =
      fmt::format("{{name: \"{}\", time_origin: {{secs: {}, nsecs: {}}}}}", name, origin.sec, origin.nsec);
  return message;
}

void write_messages(rosbag::Bag& bag, const std::vector<record::JointRecord>& joints,
                    const std::vector<ros::Time>& stamps, const ros::Time& origin) {
  using Info = ros::message_traits::DataType<std_msgs::String>;
  const auto latched = boost::make_shared<ros::M_string>();
  (*latched)["type"] = Info::value();
  (*latched)["md5sum"] = ros::message_traits::MD5Sum<std_msgs::String>::value();
  (*latched)["message_definition"] = ros::message_traits::Definition<std_msgs::String>::value();
  (*latched)["latching"] = "1";
  (*latched)["callerid"] = "/backlash_diagnosis";
  bag.write(kInfoTopic, stamps.front(), info_message(joints.front().record, origin), latched);
  const Messages messages(joints);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    sensor_msgs::JointState message = messages.at(i);
    message.header.seq = static_cast<std::uint32_t>(i);
    message.header.stamp = stamps[i];
    bag.write(kJointTopic, stamps[i], message);
  }
}

/// In CDR; seconds of ROS 2 are signed.
recording::JointState ros2_message(const sensor_msgs::JointState& message, const ros::Time& stamp) {
  recording::JointState out;
  out.seconds = static_cast<std::int32_t>(stamp.sec);
  out.nanoseconds = stamp.nsec;
  out.name = message.name;
  out.position = message.position;
  out.velocity = message.velocity;
  out.effort = message.effort;
  return out;
}

}  // namespace

void write_mcap(const std::vector<record::JointRecord>& joints, const std::string& path,
                const ros::Time& origin) {
  const record::Record& record = time_base(joints);
  const std::vector<ros::Time> stamps = stamps_of(record, origin);
  if (stamps.back().sec > static_cast<std::uint32_t>(std::numeric_limits<std::int32_t>::max()))
    throw BadData(record.name, fmt::format("time = {} s in the last sample: a ROS 2 stamp cannot hold it",
                                           to_text(record.time.back())));
  TemporaryFile file(path);
  recording::McapWriter out(file.name());
  const auto info = out.add_channel(kInfoTopic, recording::kStringType, recording::kStringDefinition);
  const auto states =
      out.add_channel(kJointTopic, recording::kJointStateType, recording::kJointStateDefinition);
  out.write(info, stamps.front().toNSec(), recording::to_cdr(info_message(record, origin).data));
  const Messages messages(joints);
  for (std::size_t i = 0; i < stamps.size(); ++i)
    out.write(states, stamps[i].toNSec(), recording::to_cdr(ros2_message(messages.at(i), stamps[i])));
  out.close();
  file.keep();
}

void write_mcap(const record::Record& record, const std::string& path, const std::string& joint,
                const ros::Time& origin) {
  write_mcap({{joint, record}}, path, origin);
}

void write_bag(const record::Record& record, const std::string& path, const std::string& joint,
               const ros::Time& origin) {
  write_bag({{joint, record}}, path, origin);
}

void write_bag(const std::vector<record::JointRecord>& joints, const std::string& path,
               const ros::Time& origin) {
  const std::vector<ros::Time> stamps = stamps_of(time_base(joints), origin);
  TemporaryFile file(path);
  auto bag = std::make_unique<rosbag::Bag>();
  try {
    bag->open(file.name(), rosbag::bagmode::Write);
    bag->setCompression(rosbag::compression::LZ4);
    write_messages(*bag, joints, stamps, origin);
    bag->close();
  } catch (const std::exception& e) {
    // Its destructor would try to write the rest and end the program when that fails too; so it is not
    // called.
    (void)bag.release();
    file.fail(std::string("rosbag: ") + e.what());
  }
  file.keep();
}

}  // namespace backlash::ros_bridge
