// SPDX-License-Identifier: BSD-3-Clause
// Which commands and methods a record serves, and what the others lack.
#pragma once

#include <optional>
#include <vector>

#include "backlash_diagnosis/arm/arm_rig.h"
#include "backlash_diagnosis/record/csv.h"
#include "backlash_diagnosis/report/record_check_report.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::tools {

/// Of a record of one joint, checked and mended. With a rig file the methods that take no more than a second
/// or so are run on it: nothing else says so surely whether they can. Without one only channels and motion
/// are asked.
std::vector<report::Serves> serves_of(const report::CheckedFile& file, const record::Record& record,
                                      const std::optional<rig_file::RigFile>& rig);

/// Of an arm: of all joints at once. `rig` is absent where only the columns are known.
std::vector<report::Serves> serves_of(const report::CheckedFile& file,
                                      const std::vector<record::JointRecord>& joints,
                                      const std::optional<arm::ArmRig>& rig);

}  // namespace backlash::tools
