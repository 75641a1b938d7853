// SPDX-License-Identifier: BSD-3-Clause
// Reading a history.
#include <filesystem>
#include <iterator>
#include <optional>
#include <system_error>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "history_line.h"
#include "history_parts.h"

namespace backlash::diagnosis {
namespace {

std::string content_of(const std::string& path) {
  std::ifstream in = open_input(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Nothing where no such file is: its writer was killed between two parts.
std::optional<std::string> content_if_any(const std::string& path) {
  try {
    return content_of(path);
  } catch (const MissingInput&) {
    std::error_code ignored;
    if (std::filesystem::exists(path, ignored)) throw;
    return std::nullopt;
  }
}

std::string_view next_line(std::string_view& rest, bool& whole) {
  const std::size_t end = rest.find('\n');
  whole = end != std::string_view::npos;
  std::string_view line = rest.substr(0, end);
  rest.remove_prefix(whole ? end + 1 : rest.size());
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);  // saved by an editor of another system
  return line;
}

void add(const std::string& path, const std::string& content, HistoryFile& history) {
  std::string_view rest = content;
  bool whole = true;
  const std::string_view header = next_line(rest, whole);
  if (!whole && kHistoryHeader.compare(0, header.size(), header) == 0) return;  // killed while it was created
  if (header != kHistoryHeader)
    throw BadData(path, "is no history of estimates: its first line is '" + printable(header) + "'");
  for (std::size_t number = 2; !rest.empty(); ++number) {
    const std::string_view line = next_line(rest, whole);
    const std::string where = printable(path, 4096) + ":" + std::to_string(number);
    try {
      history.entries.push_back(entry_from_line(line, where));
    } catch (const BadData& error) {
      history.warnings.push_back(error.what() + std::string("; left out"));
    }
  }
}

}  // namespace

HistoryFile read_history(const std::string& path) {
  // The last part first, and again should it have been rotated meanwhile.
  std::optional<std::string> last;
  std::vector<HistoryPart> parts;
  for (std::size_t seen = history_parts(path).size();; seen = parts.size()) {
    last = content_if_any(path);
    parts = history_parts(path);
    if (parts.size() == seen) break;
  }
  if (!last && parts.empty()) last = content_of(path);  // says why not
  HistoryFile history;
  for (const HistoryPart& part : parts) add(part.path, content_of(part.path), history);
  if (last) add(path, *last, history);
  return history;
}

}  // namespace backlash::diagnosis
