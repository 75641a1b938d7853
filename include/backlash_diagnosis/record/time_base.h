// SPDX-License-Identifier: BSD-3-Clause
// What is allowed in a time base, and what is said about it. One policy for CSV, bags and live topics: a
// stamp that repeats or goes back by less than a gap is long loses the later sample, gaps and jitter are kept
// and reported. One that goes back by more is a clock that was set: a reader goes on from there, a live topic
// begins anew.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace backlash::record {

class Record;

enum class StampVerdict {
  accept,     ///< later than the stamp accepted before, or the first
  repeated,   ///< equal to it, or earlier by less than kGapFactor of the intervals before it (a stamp that
              ///< jitters, a message that came late): drop this sample
  backwards,  ///< earlier by more: the data are out of order or the clock jumped
};

/// Judges stamps one after the other. A stamp that is not accepted does not change what the next is compared
/// with.
class StampChecker {
 public:
  /// `stamp` in seconds; throws InvalidParameter when it is not finite.
  StampVerdict next(double stamp);

  /// Accepts a stamp that went backwards: it and those after it are `offset` later, after a gap. False, and
  /// nothing changes, where fewer than kGapFactor were accepted since the clock was set before: out of order.
  bool resume(double stamp);

  double offset() const { return offset_; }  ///< s, from stamps to times
  double last() const { return last_; }      ///< s, the time accepted last; 0 before the first
  std::size_t accepted() const { return accepted_; }
  std::size_t repeated() const { return repeated_; }
  double first_repeated() const { return first_repeated_; }  ///< s, valid where repeated() > 0

  /// Adds what was dropped, and where the clock was set, to a record that has its times.
  void count_into(Record& record) const;

  /// Warning for Record::warnings, empty where nothing was dropped and no clock set; `where` names the place
  /// of the first repeated stamp ("line 17") if known.
  std::string describe(const std::string& where = "") const;

 private:
  double last_ = 0, first_repeated_ = 0;
  double intervals_[2] = {0, 0};  // the last two
  double offset_ = 0;
  struct Step {
    std::size_t sample;
    double back;  // s
  };
  std::vector<Step> steps_;
  std::size_t accepted_ = 0, repeated_ = 0;
};

/// A finite time in seconds with at most nine decimals, the resolution of ROS stamps: "0.3", "1700000000.25".
std::string time_text(double time);

/// Median distance between stamps [s] (mean of the middle two for an even number); 0 with fewer than two.
double median_interval(const std::vector<double>& time);

constexpr double kGapFactor = 10;  ///< an interval longer than this many medians is a gap
constexpr double kJitterFraction =
    0.05;  ///< standard deviation of the intervals over the median worth a warning

/// Warnings about gaps and jitter of an increasing time base: how many, the largest, and where. Gaps do not
/// count as jitter. Empty where the time base is even or has fewer than three stamps.
std::vector<std::string> describe_time_base(const std::vector<double>& time);

}  // namespace backlash::record
