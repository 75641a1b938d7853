// Samples of one joint as they arrive: keeps the most recent ones as a Record, counts whole excitation periods, and says
// what was wrong with those it had to leave out. Knows stamps only, no clock: replayed at any rate it does the same.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/record/time_base.h"

namespace backlash {

/// How a stream is cut; from the diagnosis settings of a rig.
struct StreamSettings {
  std::optional<ApdSettings> apd;  // absent: periods are found from motor_torque, no APD
  double keep = 60;                // s of samples kept, > 0
};

struct StreamCounters {
  long accepted = 0;
  long not_a_number = 0;  // samples without a value that the stream began with
  long repeated = 0;      // stamps equal to the one before
  long restarts = 0;      // stamps that went back or jumped: a new run begins
  std::string last_problem;
};

class SampleStream {
 public:
  explicit SampleStream(const StreamSettings& settings);

  /// Adds a sample; returns a whole settled period with its APD when this sample completes it. A stamp that goes back, or
  /// jumps by more than `jump_limit()`, starts a new run: everything kept is forgotten and settling begins again.
  /// Null where no period ends here; valid until the next call.
  const PeriodResult* add(double time, const ChannelValues& values);

  /// Whole settled periods at hand.
  long periods() const;

  /// The last `count` whole settled periods (0: all that are kept). All samples where no period is known, and for count 0
  /// without APD.
  Record latest(long count) const;

  double period() const { return period_; }  ///< s; 0 until known
  double jump_limit() const;                 ///< s
  const StreamCounters& counters() const { return counters_; }
  const Record& kept() const { return record_; }

  void restart();

 private:
  bool acceptable(const ChannelValues& values);
  void find_period();
  void start_windows();
  void trim();
  long completed_windows() const;

  StreamSettings settings_;
  StampChecker stamps_;
  StreamCounters counters_;
  Record record_;
  std::vector<Channel> channels_;  // those that the run's first sample has
  double period_ = 0, interval_ = 0, origin_ = 0, next_search_ = 0;
  std::optional<PeriodAnalyser> analyser_;
};

}  // namespace backlash
