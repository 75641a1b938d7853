// SPDX-License-Identifier: BSD-3-Clause
#include "csv_lines.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <istream>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/csv.h"

namespace backlash::record {

bool LineReader::next(std::string_view& line) {
  go_to(number() + 1);
  const char* newline = find_newline();
  while (newline == nullptr && refill()) newline = find_newline();
  const std::size_t length =
      newline != nullptr ? static_cast<std::size_t>(newline - buffer_.data()) - begin_ : filled_ - begin_;
  if (length > kLongestCsvLine) {
    fail("line is longer than " + std::to_string(kLongestCsvLine) + " bytes");
  }
  if (newline == nullptr && begin_ == filled_) return false;
  const char* const start = buffer_.data() + begin_;
  const char* const end = newline != nullptr ? newline : buffer_.data() + filled_;
  begin_ = static_cast<std::size_t>(end - buffer_.data()) + (newline != nullptr ? 1 : 0);
  line = std::string_view(start, static_cast<std::size_t>(end - start));
  if (line.find('\0') != std::string_view::npos) fail("contains a NUL byte: not a text file in UTF-8");
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  if (number() == 1 && line.substr(0, 3) == "\xef\xbb\xbf") line.remove_prefix(3);
  return true;
}

void Place::fail_at(std::size_t number, const std::string& reason) const {
  throw BadData(name_ + before_ + std::to_string(number), reason);
}

const char* LineReader::find_newline() const {
  return static_cast<const char*>(std::memchr(buffer_.data() + begin_, '\n', filled_ - begin_));
}

// Reads more behind what is there; false where there is no more or the line is too long already.
bool LineReader::refill() {
  std::memmove(buffer_.data(), buffer_.data() + begin_, filled_ - begin_);
  filled_ -= begin_;
  begin_ = 0;
  if (filled_ > kLongestCsvLine) return false;
  if (filled_ == buffer_.size()) buffer_.resize(2 * buffer_.size());
  in_.read(buffer_.data() + filled_, static_cast<std::streamsize>(buffer_.size() - filled_));
  const auto count = static_cast<std::size_t>(in_.gcount());
  filled_ += count;
  if (in_.bad()) fail("cannot be read further");
  return count > 0;
}

std::string in_quotes(std::string_view text) {
  return "'" + printable(text) + "'";
}

bool is_no_number(std::string_view text) {
  if (text.empty()) return true;
  if (text.front() == '-' || text.front() == '+') text.remove_prefix(1);
  if (text.size() > 8) return false;
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower == "nan" || lower == "inf" || lower == "infinity" || lower == "null";
}

void split(std::string_view line, char separator, std::vector<std::string_view>& fields) {
  fields.clear();
  for (;;) {
    const auto end = line.find(separator);
    fields.push_back(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return;
    line.remove_prefix(end + 1);
  }
}

}  // namespace backlash::record
