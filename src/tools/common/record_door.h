// SPDX-License-Identifier: BSD-3-Clause
// The way of a record into a command: it is looked at, what was found is said, what can be is mended, what
// cannot be used is left out, and what is wrong as a whole is refused.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/record/declared_motion.h"
#include "backlash_diagnosis/report/record_check_report.h"

namespace backlash::tools {

class RecordDoor {
 public:
  /// `command`: its name, in front of each line on standard error.
  explicit RecordDoor(std::string command) : command_(std::move(command)) {}

  /// The longest stretch of a record that nothing cuts. Throws BadData, naming `path`, where it is refused.
  record::Record admit(record::Record record, const record::DeclaredMotion& declared,
                       const std::string& path);

  /// All stretches at least half as long as the longest, each a record of its own.
  std::vector<record::Record> admit_stretches(record::Record record, const record::DeclaredMotion& declared,
                                              const std::string& path);

  struct JointJump {
    std::string joint;  // empty where the file has one
    record::Jump jump;
  };
  /// A record with its jumps taken out, for whoever looks for them, without the rows in which a channel
  /// stands still; throws as admit, and CannotIdentify where one stands still to the end.
  record::Record admit_with_jumps(record::Record record, const record::DeclaredMotion& declared,
                                  const std::string& path, std::vector<JointJump>& jumps);

  /// Of a healthy machine: the same, where it stands still to the end what is before, and jumps are not news.
  record::Record admit_healthy(record::Record record, const record::DeclaredMotion& declared,
                               const std::string& path);

  /// The joints of one file: the longest stretch in which none is cut.
  std::vector<record::JointRecord> admit(std::vector<record::JointRecord> joints, const std::string& path);
  std::vector<record::JointRecord> admit_with_jumps(std::vector<record::JointRecord> joints,
                                                    const std::string& path, std::vector<JointJump>& jumps);

  const std::string& command() const { return command_; }
  const std::vector<report::CheckedFile>& files() const { return files_; }

  /// A report with what was found.
  std::string with_findings(const std::string& json) const { return report::with_record_check(json, files_); }

 private:
  record::CheckedRecord look(record::Record record, const record::DeclaredMotion& declared,
                             const std::string& path);
  std::vector<record::JointRecord> look(std::vector<record::JointRecord> joints, const std::string& path);
  void say(const report::CheckedFile& file) const;

  std::string command_;
  std::vector<report::CheckedFile> files_;
};

/// A file of several joints as the check sees it; `joints` are mended.
report::CheckedFile checked_joints(std::vector<record::JointRecord>& joints, const std::string& path);

}  // namespace backlash::tools
