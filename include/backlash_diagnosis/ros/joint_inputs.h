// SPDX-License-Identifier: BSD-3-Clause
// The messages of all topics that some joints are on, as samples of each joint: read by its channel map, and
// joined where its channels come on several topics. Not thread-safe.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/record/sample_joiner.h"
#include "backlash_diagnosis/ros/joint_state.h"

namespace backlash::ros_bridge {

class JointInputs {
 public:
  explicit JointInputs(const std::vector<record::ChannelMap>& joints);

  /// As the maps name them, each once.
  const std::vector<std::string>& topics() const { return topics_; }

  /// `problem`: as that of JointStateReader, or that a declared name is not on its topic, with the names that
  /// are. Empty if `values` can be used.
  using OnSample = std::function<void(std::size_t joint, const ros::Time& stamp,
                                      const record::ChannelValues& values, const std::string& problem)>;

  /// Takes a message of topics()[topic], and passes on the samples that are complete with it.
  void take(std::size_t topic, const sensor_msgs::JointState& message, const OnSample& on_sample);

 private:
  struct Joint {
    record::ChannelMap map;
    std::vector<std::size_t> streams;  // by topic; how many streams it has where it is not on the topic
    std::size_t count = 0;             // streams
    StampClock clock;                  // of a joint on several topics
    std::optional<record::SampleJoiner> joiner;
  };
  struct Topic {
    JointStateReader reader;
    std::set<std::string> names;  // that have come, while one that is declared has not
    long messages = 0;
    bool complete = false;  // all declared names have come
  };

  void join(std::size_t joint, std::size_t topic, const ros::Time& stamp, const OnSample& on_sample);
  void look_for_names(std::size_t topic, const sensor_msgs::JointState& message, const OnSample& on_sample);

  std::vector<Joint> joints_;
  std::vector<std::string> topics_;
  std::vector<Topic> states_;  // of topics_
};

}  // namespace backlash::ros_bridge
