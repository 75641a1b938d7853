// SPDX-License-Identifier: BSD-3-Clause
#include "history_parts.h"

#include <algorithm>
#include <charconv>
#include <filesystem>

namespace backlash::diagnosis {
namespace {

namespace fs = std::filesystem;

/// The number of "elbow.csv.12" for "elbow.csv"; 0 for other names.
std::uintmax_t part_number(const std::string& name, const std::string& whole) {
  if (name.size() < whole.size() + 2 || name.compare(0, whole.size() + 1, whole + ".") != 0) return 0;
  const char* const first = name.data() + whole.size() + 1;
  const char* const end = name.data() + name.size();
  std::uintmax_t number = 0;
  const auto result = std::from_chars(first, end, number);
  return result.ec == std::errc() && result.ptr == end && *first != '0' ? number : 0;
}

}  // namespace

std::vector<HistoryPart> history_parts(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  const std::string whole = fs::path(path).filename().string();
  std::vector<HistoryPart> parts;
  std::error_code error;
  for (fs::directory_iterator file(folder.empty() ? "." : folder, error), end; !error && file != end;
       file.increment(error))
    if (const std::uintmax_t number = part_number(file->path().filename().string(), whole))
      parts.push_back({number, path + "." + std::to_string(number)});
  std::sort(parts.begin(), parts.end(),
            [](const HistoryPart& a, const HistoryPart& b) { return a.number < b.number; });
  return parts;
}

}  // namespace backlash::diagnosis
