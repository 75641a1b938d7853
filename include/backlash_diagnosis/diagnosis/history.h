// SPDX-License-Identifier: BSD-3-Clause
// What the verdicts on a joint said over months: a CSV file that only grows and that no kill, power cut or
// full disk can cost an entry that was written once.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/estimate.h"

namespace backlash::diagnosis {

struct Diagnosis;

/// One line of a history: what a verdict said at a time. NaN where not known.
struct HistoryEntry {
  double time = 0;                                                       // s since 1970, of the last sample
  std::string event = "estimate";                                        // or "baseline", see below
  std::string grade;                                                     // good ... cannot_tell
  double backlash = kNaN, lower = kNaN, upper = kNaN;                    // m, total free play
  double backlash_angle = kNaN, angle_lower = kNaN, angle_upper = kNaN;  // rad, axis of motor_position
  double skewness = kNaN;                                                // of the APD
  std::string methods;                                                   // that the verdict stands on, by "+"
  std::string rig_digest;                                                // as in Baseline
};

/// The event "baseline" marks where the healthy machine was taken: a trend begins anew there.
extern const char* const kEstimateEvent;
extern const char* const kBaselineEvent;

HistoryEntry history_entry(double time, const Diagnosis& diagnosis, const std::string& rig_digest);

/// Writes a history. The first line names the columns; a line per entry, numbers in full precision, an empty
/// cell where not known; `date` is for people and not read back. The last cell is in quotes, so that a line
/// that was cut off is distinguished from a whole one. At `rotate_at` bytes the file becomes PATH.1, the next
/// PATH.2 and so on; nothing is ever deleted or overwritten.
class History {
 public:
  struct Settings {
    std::string path;
    std::uintmax_t rotate_at = 10'000'000;  // bytes
  };

  /// Opens or creates the file. Throws CannotWrite (its folder is missing, another process holds it), BadData
  /// for a file that is no history. A last line that was cut off is ended, not removed.
  explicit History(Settings settings);
  ~History();
  History(History&& other) noexcept;
  History& operator=(History&& other) noexcept;
  History(const History&) = delete;
  History& operator=(const History&) = delete;

  /// When this returns, the entry is on the disk. Throws CannotWrite and leaves nothing of the entry behind:
  /// keep it and try again; the file is opened again where that is needed (also BadData then).
  /// InvalidParameter for an entry that read_history would refuse.
  void append(const HistoryEntry& entry);

  const std::string& path() const { return settings_.path; }

 private:
  Settings settings_;
  int descriptor_ = -1;

  void open();
  void close();
  bool in_place() const;
  void rotate();
  void write(const std::string& text);
};

struct HistoryFile {
  std::vector<HistoryEntry> entries;  // in the order in which they were written
  std::vector<std::string> warnings;  // "elbow.csv:17: ...": lines that were left out
};

/// All parts of a history, the oldest first; also while it is written. Throws MissingInput, and BadData for a
/// file that is no history.
HistoryFile read_history(const std::string& path);

/// s since 1970: the last entry, where it lies further before `end` than entries usually follow one another,
/// by three times their median distance and by 600 s (a choice: ten of the default interval). None: it does
/// not.
std::optional<double> silent_since(const std::vector<HistoryEntry>& entries, double end);

}  // namespace backlash::diagnosis
