// SPDX-License-Identifier: BSD-3-Clause
// What was reported of the changes of a joint, as CSV: a line for each message, the last line of an id
// counts.
#pragma once

#include <string>
#include <vector>

#include "backlash_diagnosis/diagnosis/change_ledger.h"

namespace backlash::diagnosis {

/// Appends a line; it is on the disk when this returns. Throws CannotWrite.
void append_change(const std::string& path, const KnownChange& change);

/// The last line of each change, by id; empty where there is no file. Throws BadData naming the line; a last
/// line that was cut off is left out.
std::vector<KnownChange> read_change_log(const std::string& path);

}  // namespace backlash::diagnosis
