// SPDX-License-Identifier: BSD-3-Clause
// The rig file with what an identification has found: its layout, its other values and comments stay.
#pragma once

#include <string>

#include "backlash_diagnosis/identification/identify.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::identification {

/// Values in the units of the file (of the motor shaft where it says motor_side: true), each with its
/// standard error as comment. Throws BadData where the file writes a map that has to change on one line.
std::string fitted_rig_text(const rig_file::RigFile& declared, const Identification& found);

}  // namespace backlash::identification
