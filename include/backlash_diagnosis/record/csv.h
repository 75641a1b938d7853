// SPDX-License-Identifier: BSD-3-Clause
// Records as comma separated values: the first line names the columns (`time` and the names of the channels),
// every further line is one sample. SI units, decimal point, any order of columns.
//
// Reading is strict: what is not plainly right is refused with its place. A byte order mark, CRLF, spaces
// around fields, empty lines at the end and a missing final line end are accepted. A repeated stamp loses the
// later row; that, gaps and jitter are reported in Record::warnings.
//
// A name may say its unit, `motor_position [deg]` (record/unit.h); without, it is the SI unit.
//
// A file of several joints names its columns JOINT/channel: one Record per joint, all on one time base.
//
// A file with names of its own is read by a channel map. There, comment lines may stand above the header,
// which is the first line that has all columns of the map; fields are separated by comma, semicolon or tab
// and may be in quotes; a row of units may follow; between semicolons or tabs numbers may have a decimal
// comma, in all of the file or nowhere. Columns that the map does not name are not read.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <vector>

#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

constexpr std::size_t kLongestCsvLine = std::size_t{1} << 20;  ///< bytes
constexpr std::size_t kLinesToHeader = 100;  ///< of a file that a map reads, in which its header must stand

/// Throws MissingInput when the file cannot be opened, BadData "path:17: motor_torque = 'abc': not a number"
/// when its content cannot be used, and where the file has several joints. Record::name is the path as given.
Record read_csv(const std::string& path);
Record read_csv(std::istream& in, const std::string& name);

/// The columns that the map names; where the file is in the package's own format instead, that: the joint of
/// the name (record_of_joint).
Record read_csv(const std::string& path, const ChannelMap& map, const std::string& joint);
Record read_csv(std::istream& in, const std::string& name, const ChannelMap& map, const std::string& joint);

/// A joint of a record; no name where the columns have none.
struct JointRecord {
  std::string joint;
  Record record;
};

/// The joints of a file in the order of their first column; a file of one joint gives one without a name.
/// Throws as read_csv. The warnings on the time base are those of the first joint.
/// `linear`: the axis has m and N, which units in the header must fit.
std::vector<JointRecord> read_joints_csv(const std::string& path, bool linear = false);
std::vector<JointRecord> read_joints_csv(std::istream& in, const std::string& name, bool linear = false);

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
