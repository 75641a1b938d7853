// SPDX-License-Identifier: BSD-3-Clause
// The history of a joint that the diagnoser keeps, and its trend. A thread that may wait for the disk writes
// entries to a file; entries that could not be written are kept and tried again.
#pragma once

#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/history.h"
#include "backlash_diagnosis/diagnosis/limits.h"
#include "backlash_diagnosis/diagnosis/trend.h"

namespace backlash::ros_bridge {

class JointHistory {
 public:
  struct Settings {
    std::string path;
    double interval = 60;  // s of stamps at least from one entry to the next
    bool angular = false;  // whether the trend is of angles [rad] instead of [m]
    std::string rig_digest;
  };
  struct State {
    std::string path;
    long entries = 0;     // written since the start
    long waiting = 0;     // not written yet
    long left_out = 0;    // older than the last one: a looped bag, or a clock set back
    bool behind = false;  // the latest verdict was left out
    long lost = 0;        // given up, as too many waited
    std::string problem;  // why the last attempt to write failed; empty: it did not
    diagnosis::Trend trend;
  };

  /// Opens the file and reads what it holds. Throws CannotWrite, BadData.
  explicit JointHistory(const Settings& settings);

  /// Adds the verdict at a stamp [s since 1970] if the interval since the last entry is over; does not wait
  /// for the disk.
  void take(double stamp, const diagnosis::Diagnosis& diagnosis);
  /// Marks where the baseline was stored: the trend begins there.
  void take_baseline(double stamp, const diagnosis::Diagnosis& diagnosis);

  /// Writes the entries that wait, and after new ones computes the trend towards `limit` (service, in the
  /// unit of the trend). Always from the same thread.
  void flush(std::optional<double> limit);

  State state() const;

 private:
  void add(diagnosis::HistoryEntry entry);
  void add_points(const std::vector<diagnosis::HistoryEntry>& entries);

  Settings settings_;
  diagnosis::History history_;
  mutable std::mutex mutex_;
  std::deque<diagnosis::HistoryEntry> waiting_;
  std::optional<double> last_;  // s, of the latest entry
  State state_;
  std::vector<diagnosis::TrendPoint> points_;  // since the last baseline; of the flushing thread
  std::optional<double> limit_;
  bool stale_trend_ = true;
};

}  // namespace backlash::ros_bridge
