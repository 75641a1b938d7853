// SPDX-License-Identifier: BSD-3-Clause
// The files PATH.1, PATH.2, ... that a history left behind.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace backlash::diagnosis {

struct HistoryPart {
  std::uintmax_t number = 0;
  std::string path;
};

/// By rising number; none where the folder cannot be read.
std::vector<HistoryPart> history_parts(const std::string& path);

}  // namespace backlash::diagnosis
