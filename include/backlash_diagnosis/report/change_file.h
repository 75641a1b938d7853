// SPDX-License-Identifier: BSD-3-Clause
// The JSON that `detect_changes` writes, read by who has run it.
#pragma once

#include <string>

#include "backlash_diagnosis/diagnosis/change_ledger.h"

namespace backlash::report {

/// Times of the file are those of its record; `origin` [s since 1970] is what they count from. The stretch
/// (ChangeLook::from, to) is not in the file. `of_arm`: changes are of one of its joints each. Throws
/// MissingInput, BadData.
diagnosis::ChangeLook read_changes(const std::string& path, double origin, bool of_arm = false);

/// "elbow: motor_coulomb since 2027-03-01T12:30:05Z (12:30:04 to 12:30:06): motor_coulomb 0.61 +- 0.02 N m"
std::string change_text(const diagnosis::FoundChange& change);

}  // namespace backlash::report
