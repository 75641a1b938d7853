// SPDX-License-Identifier: BSD-3-Clause
// What the change watch keeps of one joint, or of an arm: its newest samples, the healthy machine that it has
// learned or was given, and the changes that looks have found. Samples come from one thread, looks run in
// another; a look runs the command detect_changes as a process.
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/diagnosis/change_ledger.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/sample_ring.h"
#include "backlash_diagnosis/ros/job.h"
#include "backlash_diagnosis/ros/joint_rigs.h"
#include "backlash_diagnosis/ros/joint_state.h"

namespace backlash::ros_bridge {

struct WatchSettings {
  JointRig joint;                              // of an arm only its name
  std::optional<arm::ArmRig> arm;              // an arm, whose joints are watched together
  std::vector<record::ChannelMap> arm_joints;  // where they are published
  std::vector<std::string> healthy;            // records of the healthy machine; empty: it is learned
  std::string learned;             // record that is written where it is learned, and taken where it exists
  std::string changed;             // record that is written: that of the last look with something to report
  std::string log;                 // of diagnosis/change_log.h; empty: none
  double learn = 600;              // s of samples that the healthy machine is learned from, > 0
  double window = 300;             // s that a look sees, > 0
  double check_interval = 60;      // s from one look to the next, > 0
  double rate = 1.0 / 720;         // 1/h, of one look (diagnosis::rate_of_look)
  double job_memory = kJobMemory;  // GB

  /// Of the joint, or of each of the arm's.
  std::vector<record::ChannelMap> channels() const {
    return arm ? arm_joints : std::vector<record::ChannelMap>{joint.channels()};
  }
};

struct WatchState {
  record::RingCounters counters;
  long bad_messages = 0;
  std::string last_problem;  // with a message
  bool any_sample = false;
  ros::WallTime last_arrival;
  std::string healthy;         // where the healthy machine is from; empty: it is not known yet
  double learning = 0;         // s of samples kept for it
  long looks = 0, judged = 0;  // done, and those with an answer
  long left_out = 0;           // looks that were due while one ran
  std::string why_not;         // why the last look has no answer; empty: it has one
  std::string log_problem;     // why what was reported is not in the log, or its record not written
  double from = 0, to = 0;     // s since 1970, of the last look with an answer
  long windows = 0;            // of motion, in it
  std::vector<diagnosis::KnownChange> changes;
  std::vector<std::string> different;  // since an unknown time
  std::vector<std::string> unjudged;   // joints that the last look with an answer leaves out, and why
};

class JointWatch {
 public:
  /// Throws BadData for a log that is none, MissingInput for healthy records that are not there.
  explicit JointWatch(WatchSettings settings);

  const std::string& joint() const { return settings_.joint.joint; }
  const WatchSettings& settings() const { return settings_; }

  /// Takes a sample, or what is wrong with a message. True if a look has become due. `joint`: which joint of
  /// an arm.
  bool take(const ros::Time& stamp, const record::ChannelValues& values, const std::string& problem,
            const std::string& topic, std::size_t joint = 0);

  /// If a look is due: learns the healthy machine, or compares the newest samples with it. Returns the
  /// changes that are new or known better. Throws Cancelled if `go_on` demands it.
  std::vector<diagnosis::KnownChange> look(const Progress& go_on);

  WatchState state() const;

 private:
  struct Task {
    std::vector<record::JointRecord> joints;  // on one time base
    double origin = 0;                        // s since 1970
    double length() const { return joints.front().record.time.back(); }
    long run = 0;  // of the clock
    std::vector<std::string> healthy;
  };

  double look_length() const { return healthy_.empty() ? settings_.learn : settings_.window; }
  std::optional<Task> begin_look();
  std::vector<record::JointRecord> kept() const;
  void write(const std::vector<record::JointRecord>& joints, const std::string& path) const;
  /// What detect_changes finds in the record of a task. Throws if it fails.
  diagnosis::ChangeLook found(const Task& task, const Progress& go_on) const;
  void learn(const Task& task, const Progress& go_on);
  std::vector<diagnosis::KnownChange> judge(const Task& task, const diagnosis::ChangeLook& look);
  void cannot_tell(const std::string& why);

  WatchSettings settings_;
  mutable std::mutex mutex_;
  StampClock clock_;
  std::vector<record::SampleRing> rings_;  // of the joint, or of each of the arm's
  std::vector<std::string> healthy_;
  diagnosis::ChangeLedger ledger_;
  WatchState state_;
  std::string impossible_;      // why this joint cannot be watched at all; empty: it can
  std::optional<double> next_;  // s of clock_, when the next look is due
  bool due_ = false, looking_ = false;
};

}  // namespace backlash::ros_bridge
