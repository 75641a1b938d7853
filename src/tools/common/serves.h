// SPDX-License-Identifier: BSD-3-Clause
// Which commands and methods a record serves, and what the others lack.
#pragma once

#include <optional>
#include <vector>

#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/report/record_check_report.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "tools/common/command_line.h"

namespace backlash::tools {

/// Of a record of one joint, checked and mended. With a rig file the methods that take no more than a second
/// or so are run on it: nothing else says so surely whether they can. Without one only channels and motion
/// are asked.
std::vector<report::Serves> serves_of(const report::CheckedFile& file, const record::Record& record,
                                      const std::optional<rig_file::RigFile>& rig);

/// What check_record saw.
struct Looked {
  report::CheckedFile file;
  std::vector<report::Serves> serves;
  std::vector<record::JointRecord> recorded{};  // as it was read, where a plot is asked for
  bool linear = false;
};

/// Of an arm: of all joints at once. `drive` is the channel of its drives by the rig file, absent where only
/// the columns are known.
Looked look_at_joints(std::vector<record::JointRecord> joints, const std::string& path,
                      const std::optional<record::Channel>& drive, bool for_plot);

/// Prints, writes and draws it, and returns the exit code of check_record. Outputs are checked already.
int report_of(const Looked& looked, const Arguments& arguments);

}  // namespace backlash::tools
