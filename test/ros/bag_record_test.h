// SPDX-License-Identifier: BSD-3-Clause
// A folder for bags, and a bag as a recorder writes it.
#pragma once

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/String.h>
#include <stdlib.h>  // NOLINT: mkdtemp is not in cstdlib

#include <cmath>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "backlash_diagnosis/record/record.h"

namespace backlash::ros_bridge {

namespace fs = std::filesystem;

class BagRecord : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::path(testing::TempDir()) / "bag_record_XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string file(const std::string& name) const { return (folder_ / name).string(); }

  std::string write_bytes(const std::string& name, const std::string& bytes) const {
    std::ofstream(file(name), std::ios::binary) << bytes;
    return file(name);
  }

  static std::string bytes_of(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  /// Message text of an exception of a certain type; fails the test where there is none.
  template <typename Exception, typename Action>
  static std::string message_of(const Action& action) {
    try {
      action();
    } catch (const Exception& e) {
      return e.what();
    } catch (const std::exception& e) {
      ADD_FAILURE() << "other exception: " << e.what();
      return "";
    }
    ADD_FAILURE() << "no exception";
    return "";
  }

  static void expect_contains(const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text << "\nlacks: " << part;
  }

  fs::path folder_;
};

/// A bag as a recorder writes it, message by message.
class Recording {
 public:
  explicit Recording(const std::string& path) { bag_.open(path, rosbag::bagmode::Write); }
  ~Recording() { bag_.close(); }

  static sensor_msgs::JointState motor(double stamp, double position = 1, double velocity = 2,
                                       double effort = 3, const std::string& joint = "joint") {
    sensor_msgs::JointState m;
    m.header.stamp.fromSec(stamp);
    m.name = {joint + "_motor"};
    m.position = {position};
    m.velocity = {velocity};
    m.effort = {effort};
    return m;
  }

  /// Received one second after the message before, whatever its stamp says.
  Recording& add(const sensor_msgs::JointState& m, const std::string& topic = "/joint_states") {
    bag_.write(topic, ros::Time(received_++, 0), m);
    return *this;
  }

  Recording& add_text(const std::string& topic, const std::string& text) {
    std_msgs::String m;
    m.data = text;
    bag_.write(topic, ros::Time(received_++, 0), m);
    return *this;
  }

 private:
  rosbag::Bag bag_;
  std::uint32_t received_ = 100;
};

inline record::Record sample_record(std::vector<double> time = {0, 0.001, 0.0020000005, 0.003, 17}) {
  record::Record record;
  record.name = "run \"a\".csv";
  record.time = std::move(time);
  double value = 0.1;
  for (const record::Channel channel : record::kChannels)
    for (std::size_t i = 0; i < record.size(); ++i)
      record.column(channel).push_back(value = std::sin(97 * value + 1));
  record.column(record::Channel::motor_torque)[1] = -0.0;
  record.column(record::Channel::sensor_torque)[1] = std::numeric_limits<double>::denorm_min();
  record.column(record::Channel::load_position)[1] = std::numeric_limits<double>::max();
  return record;
}

inline void expect_same_columns(const record::Record& a, const record::Record& b) {
  for (const record::Channel channel : record::kChannels)
    EXPECT_EQ(a.column(channel), b.column(channel)) << record::channel_name(channel);
}

}  // namespace backlash::ros_bridge
