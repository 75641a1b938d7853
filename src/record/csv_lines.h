// SPDX-License-Identifier: BSD-3-Clause
// Lines of a text file and their places: what every reader of CSV is made of.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

namespace backlash::record {

/// Lines of a stream in pieces of bounded size: a device or a file without line ends must not fill the
/// memory.
class LineReader {
 public:
  LineReader(std::istream& in, const std::string& name)
      : in_(in), name_(name), buffer_(std::size_t{1} << 16, '\0') {}

  /// The next line without its end; valid until the next call. False at the end of the stream.
  bool next(std::string_view& line);

  std::size_t number() const { return number_; }

  [[noreturn]] void fail(const std::string& reason) const { fail_at(number_, reason); }
  [[noreturn]] void fail_at(std::size_t line, const std::string& reason) const;

 private:
  const char* find_newline() const;
  bool refill();

  std::istream& in_;
  const std::string name_;
  std::string buffer_;
  std::size_t begin_ = 0, filled_ = 0, number_ = 0;
};

/// "'text'", for messages.
std::string in_quotes(std::string_view text);

/// The fields of a line without the spaces around them, as views into it.
void split(std::string_view line, char separator, std::vector<std::string_view>& fields);

/// Calls `row` for each line. Empty lines may end the file; throws BadData where one stands amid the data.
template <typename Row>
void each_row(LineReader& lines, const Row& row) {
  std::string_view line;
  std::size_t empty_line = 0;
  while (lines.next(line)) {
    if (line.find_first_not_of(" \t") == std::string_view::npos) {
      if (empty_line == 0) empty_line = lines.number();
      continue;
    }
    if (empty_line != 0) lines.fail_at(empty_line, "an empty line amid the data");
    row(line);
  }
}

}  // namespace backlash::record
