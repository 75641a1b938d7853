// SPDX-License-Identifier: BSD-3-Clause
// One page of a day of a robot, from what its monitors kept: how much play each joint had, when that was
// estimated, and what has changed.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/change_ledger.h"
#include "backlash_diagnosis/diagnosis/history.h"
#include "backlash_diagnosis/report/report_page.h"

namespace backlash::report {

/// Of one joint what falls into the day.
struct JointDay {
  std::string joint;
  std::vector<diagnosis::HistoryEntry> estimates;  // with and without a result, the oldest first
  std::vector<diagnosis::KnownChange> changes;     // that were so at some time of it, none withdrawn
  std::optional<double> silent_since;              // s since 1970: no entry since, up to the end or to now
};

struct Day {
  double from = 0, to = 0;  // s since 1970
  double now = kNaN;        // s since 1970, of which the page speaks as now; NaN: of no moment beside the day
  std::vector<JointDay> joints;
  std::vector<std::string> warnings;
};

/// Whether an estimate says how much play there is.
bool has_play(const diagnosis::HistoryEntry& entry);

/// The files of a folder that `~history` of diagnoser and change_watch filled: JOINT.csv, JOINT_changes.csv.
/// `to` NaN: the day ends with the last entry of all, and how long ago that was at `now` is said. Throws
/// MissingInput, BadData for a folder without any and for a file that is none.
Day read_day(const std::string& folder, double to, double hours, double now = kNaN);

/// Whether all joints are silent up to now.
bool silent(const Day& day);

/// "3 joints, 2 changes: wrist motor_coulomb since ...", one line.
std::string day_summary(const Day& day);

std::string day_json(const Day& day);
std::string day_page(const Day& day, const Provenance& provenance);

}  // namespace backlash::report
