// SPDX-License-Identifier: BSD-3-Clause
// What the check of a recording found, for people and for programs.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/record_check.h"

namespace backlash::report {

/// A file that was looked at. A file of several joints has a check for each.
struct CheckedFile {
  struct Joint {
    std::string name;  // empty where the file has one joint
    record::RecordCheck check;
  };
  std::string path;
  std::vector<Joint> joints;

  /// Of all joints, channels as "JOINT/channel"; what is said of stamps only once.
  std::vector<record::Finding> findings() const;
};

/// Whether a command or method can use a record, and why.
struct Serves {
  std::string name;  // of the command or method
  bool ok = false;
  std::string reason;
};

/// The JSON of the command check_record.
std::string record_check_json(const CheckedFile& file, const std::vector<Serves>& serves);

/// The same for people: a line per channel, per finding, per command and method.
std::string record_check_text(const CheckedFile& file, const std::vector<Serves>& serves);

/// What a plot of it shows (scripts/plot_check.py): the channels of the joints as they were recorded, in the
/// order of `file`, and the report. Of long records the lowest and the highest of neighbouring samples.
std::string record_check_series(const CheckedFile& file, const std::vector<record::JointRecord>& recorded,
                                bool linear);

/// A report with what the check of its records found, as "record_check".
std::string with_record_check(const std::string& json, const std::vector<CheckedFile>& files);

}  // namespace backlash::report
