// SPDX-License-Identifier: BSD-3-Clause
// Records as comma separated values: the first line names the columns (`time` and the names of the channels),
// every further line is one sample. SI units, decimal point, any order of columns.
//
// Reading is strict: what is not plainly right is refused with its place. A byte order mark, CRLF, spaces
// around fields, empty lines at the end and a missing final line end are accepted. A repeated stamp loses the
// later row; that, gaps and jitter are told in Record::warnings.
//
// A file of several joints names its columns JOINT/channel: one Record per joint, all on one time base.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <vector>

#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

constexpr std::size_t kLongestCsvLine = std::size_t{1} << 20;  ///< bytes

/// Throws MissingInput when the file cannot be opened, BadData "path:17: motor_torque = 'abc': not a number"
/// when its content cannot be used, and where the file has several joints. Record::name is the path as given.
Record read_csv(const std::string& path);
Record read_csv(std::istream& in, const std::string& name);

/// A joint of a record; no name where the columns have none.
struct JointRecord {
  std::string joint;
  Record record;
};

/// The joints of a file in the order of their first column; a file of one joint gives one without a name.
/// Throws as read_csv. The warnings on the time base are those of the first joint.
std::vector<JointRecord> read_joints_csv(const std::string& path);
std::vector<JointRecord> read_joints_csv(std::istream& in, const std::string& name);

/// The joint of that name, or the only one there is. Throws BadData with the joints that are there.
Record record_of_joint(std::vector<JointRecord> joints, const std::string& joint, const std::string& name);

/// Writes the file whole or not at all. Values have all their digits: reading gives the same doubles. Times
/// have at most nine decimals (1 ns). Throws CannotWrite when the file cannot be written, BadData when
/// read_csv would not read it back: no samples, no torque or position, columns of unequal length, values that
/// are not finite, times that do not increase by a nanosecond.
void write_csv(const Record& record, const std::string& path);

/// The same for several joints with one time base, columns JOINT/channel. Throws also BadData where the times
/// of two joints differ.
void write_joints_csv(const std::vector<JointRecord>& joints, const std::string& path);

}  // namespace backlash::record
