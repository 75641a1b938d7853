// SPDX-License-Identifier: BSD-3-Clause
// A history's lines as text.
#pragma once

#include <string>
#include <string_view>

#include "backlash_diagnosis/diagnosis/history.h"

namespace backlash::diagnosis {

extern const std::string kHistoryHeader;  // without newline

/// Without newline. Throws InvalidParameter for an entry that could not be read back.
std::string to_line(const HistoryEntry& entry);

/// Throws BadData with `where` in front.
HistoryEntry entry_from_line(std::string_view line, const std::string& where);

}  // namespace backlash::diagnosis
