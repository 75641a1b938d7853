// SPDX-License-Identifier: BSD-3-Clause
// Lines of a text file and their places: what every reader of CSV is made of.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace backlash::record {

/// Where in a file something was read, for messages: "run.csv:17", "run.json, entry 17".
class Place {
 public:
  Place(std::string name, std::string before) : name_(std::move(name)), before_(std::move(before)) {}

  std::size_t number() const { return number_; }
  std::string text(std::size_t number) const {
    return before_ == ":" ? "line " + std::to_string(number) : before_.substr(2) + std::to_string(number);
  }
  void go_to(std::size_t number) { number_ = number; }

  [[noreturn]] void fail(const std::string& reason) const { fail_at(number_, reason); }
  [[noreturn]] void fail_at(std::size_t number, const std::string& reason) const;

 private:
  std::string name_, before_;
  std::size_t number_ = 0;
};

/// Lines of a stream in pieces of bounded size: a device or a file without line ends must not fill the
/// memory.
class LineReader : public Place {
 public:
  LineReader(std::istream& in, const std::string& name)
      : Place(name, ":"), in_(in), buffer_(std::size_t{1} << 16, '\0') {}

  /// The next line without its end; valid until the next call. False at the end of the stream.
  bool next(std::string_view& line);

 private:
  const char* find_newline() const;
  bool refill();

  std::istream& in_;
  std::string buffer_;
  std::size_t begin_ = 0, filled_ = 0;
};

/// "'text'", for messages.
std::string in_quotes(std::string_view text);

/// What loggers write where they have no number: nothing, or nan, inf, infinity, null in any case and with
/// any sign.
bool is_no_number(std::string_view text);

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
