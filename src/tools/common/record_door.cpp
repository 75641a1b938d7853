// SPDX-License-Identifier: BSD-3-Clause
#include "tools/common/record_door.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/numbers.h"

namespace backlash::tools {
namespace {

constexpr double kWorthwhile = 0.5;  // choice: of the longest stretch; shorter ones add little to it

void refuse_if(const report::CheckedFile& file) {
  for (const record::Finding& finding : file.findings())
    if (finding.consequence == record::Consequence::refused) throw BadData(file.path, finding.message);
}

/// What a cut leaves is said beside whatever comes out of it.
record::Record part_of(record::Record record, const record::Stretch& stretch,
                       const std::vector<std::string>& why) {
  record = std::move(record).slice(stretch.from, stretch.to);
  if (record.size() == 0) return record;
  for (const std::string& reason : why) record.warnings.push_back(reason);
  record.warnings.push_back(
      fmt::format("used from {:.6g} to {:.6g} s", record.time.front(), record.time.back()));
  return record;
}

std::vector<std::string> cuts_of(const report::CheckedFile& file) {
  std::vector<std::string> why;
  for (const record::Finding& finding : file.findings())
    if (finding.consequence == record::Consequence::cut) why.push_back(finding.message);
  return why;
}

/// The longest time in which no joint is cut.
record::Stretch longest_of_all(const report::CheckedFile& file) {
  std::vector<record::Stretch> common = file.joints.front().check.usable;
  for (const report::CheckedFile::Joint& joint : file.joints) {
    std::vector<record::Stretch> both;
    for (const record::Stretch& a : common)
      for (const record::Stretch& b : joint.check.usable)
        if (std::max(a.from, b.from) < std::min(a.to, b.to))
          both.push_back({std::max(a.from, b.from), std::min(a.to, b.to)});
    common = both;
  }
  record::RecordCheck all;
  all.usable = common;
  return record::longest_stretch(all);
}

/// Of joints on one time base the rows that all have; else of each its own.
void drop_rows_without_numbers(std::vector<record::JointRecord>& joints) {
  std::vector<record::Record*> all;
  for (record::JointRecord& joint : joints) {
    all.push_back(&joint.record);
    if (joint.record.time != joints.front().record.time) all.clear();
    if (all.empty()) break;
  }
  if (!all.empty()) return record::keep_rows_with_numbers(all);
  for (record::JointRecord& joint : joints) record::keep_rows_with_numbers({&joint.record});
}

/// Where a channel stands still nothing is known; a step of the clock is a rest.
void leave_out_frozen(const report::CheckedFile& file, const std::vector<record::Record*>& records) {
  for (const record::Finding& finding : file.findings()) {
    if (finding.kind != record::FindingKind::frozen) continue;
    for (record::Record* record : records) {
      std::vector<bool> rows;
      for (const double t : record->time) rows.push_back(t < finding.from || t > finding.to);
      record::keep_rows(*record, rows);
    }
  }
}

/// A channel that does not go on again has failed.
void refuse_failed(const report::CheckedFile& file, double end) {
  for (const record::Finding& finding : file.findings())
    if (finding.kind == record::FindingKind::frozen && finding.to >= end)
      throw CannotIdentify(file.path + ": " + finding.message);
}

/// Whether all joints, of several, jump with this one: a recording that goes on elsewhere, as no encoder is
/// at fault of all.
bool all_jump(const report::CheckedFile& file, const record::Jump& jump) {
  return file.joints.size() > 1 &&
         std::all_of(file.joints.begin(), file.joints.end(), [&](const auto& joint) {
           const std::vector<record::Jump>& jumps = joint.check.jumps;
           return std::any_of(jumps.begin(), jumps.end(), [&](const record::Jump& other) {
             return other.before <= jump.after && jump.before <= other.after;
           });
         });
}

}  // namespace

report::CheckedFile checked_joints(std::vector<record::JointRecord>& joints, const std::string& path) {
  report::CheckedFile file{path, {}};
  record::DeclaredMotion declared;
  declared.shares_stamps = joints.size() > 1;
  for (record::JointRecord& joint : joints) {
    record::CheckedRecord checked = record::check_record(std::move(joint.record), declared);
    joint.record = std::move(checked.record);
    file.joints.push_back({joint.joint, std::move(checked.check)});
  }
  drop_rows_without_numbers(joints);
  return file;
}

void RecordDoor::say(const report::CheckedFile& file) const {
  for (const record::Finding& finding : file.findings())
    std::cerr << command_ << ": " << printable(file.path, 4096) << ": " << finding.message << '\n';
}

record::CheckedRecord RecordDoor::look(record::Record record, const record::DeclaredMotion& declared,
                                       const std::string& path) {
  record::CheckedRecord checked = record::check_record(std::move(record), declared);
  files_.push_back({path, {{"", checked.check}}});
  refuse_if(files_.back());
  say(files_.back());
  return checked;
}

record::Record RecordDoor::admit(record::Record record, const record::DeclaredMotion& declared,
                                 const std::string& path) {
  record::CheckedRecord checked = look(std::move(record), declared, path);
  const std::vector<std::string> why = cuts_of(files_.back());
  if (why.empty()) return std::move(checked.record);
  return part_of(std::move(checked.record), record::longest_stretch(checked.check), why);
}

std::vector<record::Record> RecordDoor::admit_stretches(record::Record record,
                                                        const record::DeclaredMotion& declared,
                                                        const std::string& path) {
  const record::CheckedRecord checked = look(std::move(record), declared, path);
  const std::vector<std::string> why = cuts_of(files_.back());
  if (why.empty()) return {checked.record};
  const double least = kWorthwhile * record::longest_stretch(checked.check).duration();
  std::vector<record::Record> parts;
  for (const record::Stretch& stretch : checked.check.usable) {
    if (stretch.duration() < least) continue;
    parts.push_back(part_of(checked.record, stretch, parts.empty() ? why : std::vector<std::string>()));
    parts.back().name += fmt::format(" from {:.6g} s", stretch.from);
  }
  return parts;
}

record::Record RecordDoor::admit_healthy(record::Record record, const record::DeclaredMotion& declared,
                                         const std::string& path) {
  record::CheckedRecord checked = look(std::move(record), declared, path);
  leave_out_frozen(files_.back(), {&checked.record});
  return record::without_jumps(std::move(checked.record), checked.check.jumps);
}

record::Record RecordDoor::admit_with_jumps(record::Record record, const record::DeclaredMotion& declared,
                                            const std::string& path, std::vector<JointJump>& jumps) {
  record::CheckedRecord checked = look(std::move(record), declared, path);
  refuse_failed(files_.back(), checked.record.time.back());
  leave_out_frozen(files_.back(), {&checked.record});
  for (const record::Jump& jump : checked.check.jumps) jumps.push_back({"", jump});
  return record::without_jumps(std::move(checked.record), checked.check.jumps);
}

std::vector<record::JointRecord> RecordDoor::look(std::vector<record::JointRecord> joints,
                                                  const std::string& path) {
  files_.push_back(checked_joints(joints, path));
  refuse_if(files_.back());
  say(files_.back());
  return joints;
}

std::vector<record::JointRecord> RecordDoor::admit(std::vector<record::JointRecord> joints,
                                                   const std::string& path) {
  joints = look(std::move(joints), path);
  const std::vector<std::string> why = cuts_of(files_.back());
  if (why.empty()) return joints;
  const record::Stretch longest = longest_of_all(files_.back());
  for (record::JointRecord& joint : joints)
    joint.record = part_of(std::move(joint.record), longest,
                           &joint == &joints.front() ? why : std::vector<std::string>());
  return joints;
}

std::vector<record::JointRecord> RecordDoor::admit_with_jumps(std::vector<record::JointRecord> joints,
                                                              const std::string& path,
                                                              std::vector<JointJump>& jumps) {
  joints = look(std::move(joints), path);
  refuse_failed(files_.back(), joints.front().record.time.back());
  std::vector<record::Record*> records;
  for (record::JointRecord& joint : joints) records.push_back(&joint.record);
  leave_out_frozen(files_.back(), records);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    std::vector<record::Jump> found = files_.back().joints[j].check.jumps;
    found.erase(std::remove_if(found.begin(), found.end(),
                               [&](const record::Jump& jump) { return all_jump(files_.back(), jump); }),
                found.end());
    joints[j].record = record::without_jumps(std::move(joints[j].record), found);
    for (const record::Jump& jump : found) jumps.push_back({joints[j].joint, jump});
  }
  return joints;
}

}  // namespace backlash::tools
