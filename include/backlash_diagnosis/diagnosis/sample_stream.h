// SPDX-License-Identifier: BSD-3-Clause
// Samples of one joint as they arrive: keeps the most recent ones as a Record, counts whole excitation
// periods, and says what was wrong with those it had to leave out. Knows stamps only, no clock: replayed at
// any rate it does the same. The one place where a run is cut into periods: records are cut by it as well.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/apd_skewness.h"
#include "backlash_diagnosis/record/time_base.h"

namespace backlash::diagnosis {

/// How a stream is cut; from the diagnosis settings of a rig.
struct StreamSettings {
  std::optional<ApdSettings> apd;  // absent: periods are found from motor_torque, no APD
  double keep = 60;                // s of samples kept, > 0; always at least three periods
  /// The samples are those of a record: no gap begins a new run, and the signal of the APD may be missing.
  bool of_record = false;
};

struct StreamCounters {
  long accepted = 0;
  long not_a_number = 0;  // samples without a finite value in a channel that the run has
  long repeated = 0;      // stamps equal to the one before
  long restarts =
      0;  // stamps that went back or jumped, or a channel that appeared or is gone: a new run begins
  std::string last_problem;
};

class SampleStream {
 public:
  explicit SampleStream(const StreamSettings& settings);

  /// Adds a sample; returns a settled period with its APD (see PeriodResult::complete) when this sample ends
  /// it. A stamp that goes back, or jumps by more than `jump_limit()`, or a channel that appears or
  /// has been gone for as long, starts a new run: everything kept is forgotten and settling begins again.
  /// Null where no period ends here; valid until the next call. Throws InvalidParameter for a stamp that is
  /// not finite.
  const PeriodResult* add(double time, const record::ChannelValues& values);

  /// Adds all samples of a record.
  void add(const record::Record& record);

  /// Whole settled periods at hand.
  long periods() const;

  /// The last `count` whole settled periods (0: all that are kept); empty where there are none yet. All
  /// samples where the excitation has no period, and for count 0 without APD. A copy, whose cost grows with
  /// the samples asked for, but of a stream that ends with this.
  PeriodWindow latest(long count) const&;
  PeriodWindow latest(long count) &&;

  double period() const { return period_; }  ///< s; 0 until known
  double jump_limit() const;                 ///< s; infinite for a record
  double sampling_interval() const;          ///< s, median of the latest samples; 0 with fewer than two
  const StreamCounters& counters() const { return counters_; }
  const record::Record& kept() const { return record_; }

  void restart();

 private:
  enum class Fit { begin, take, drop, restart };
  struct Windows {
    long begin, end;  // settled and still kept whole: [begin, end)
  };
  Fit fit(const record::ChannelValues& values);
  Fit fit(double time);
  record::Channel needed() const;
  bool has_lost_channel(double time, const record::ChannelValues& values) const;
  void find_period();
  const PeriodResult* start_windows();
  const PeriodResult* analyse(double time, double value);
  void trim();
  void forget_results();
  Windows windows() const;
  Windows latest_windows(long count) const;
  std::vector<PeriodResult> results(const Windows& cut) const;
  PeriodWindow searched_now(long count) const;

  StreamSettings settings_;
  record::StampChecker stamps_;
  StreamCounters counters_;
  record::Record record_;
  std::vector<record::Channel> channels_;  // those that the run's first sample has
  unsigned present_ = 0;                   // the same, a bit each
  double period_ = 0, start_ = 0;          // s; first stamp of the run
  double next_search_ = 0;                 // s after start_
  std::optional<double> dropped_;          // s, last stamp that was trimmed since the windows began
  std::optional<WindowGrid> grid_;         // once the period and kLeadingSamples samples are there
  std::optional<PeriodAnalyser> analyser_;
  std::vector<PeriodResult> results_;  // of the windows kept, settling included; storage beyond for the next
  std::size_t result_count_ = 0;
};

/// The whole settled periods of a record (`last` > 0: only so many of them, the last), as a stream that keeps
/// all of it cuts them. Without `apd` the period is that of motor_torque, and nothing settles.
PeriodWindow cut_periods(const record::Record& record, const std::optional<ApdSettings>& apd, long last = 0);

}  // namespace backlash::diagnosis
