// SPDX-License-Identifier: BSD-3-Clause
// A CSV with names and units of its own, or none, read by a channel map.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/record/record.h"
#include "csv_lines.h"
#include "mapped_rows.h"

namespace backlash::record {

class MappedCsv {
 public:
  MappedCsv(std::istream& in, const std::string& name, const ChannelMap& map);

  /// Whether one of the first lines, or two of them together, has all columns of the map, or numbers where
  /// the map says columns by number; the rows follow.
  bool find_header();

  /// After find_header() without success: whether the file begins as one in the package's own format, else
  /// the BadData that says which column lacks.
  bool first_line_is_own() const { return first_line_is_own_; }
  [[noreturn]] void refuse() const;

  /// After find_header(). Throws BadData.
  Record read();

 private:
  bool is_header(std::string_view line);
  bool is_two_lines(std::string_view line);
  bool holds_all_columns(std::string_view line, char separator);
  bool is_first_row(std::string_view line);
  bool has_numbers(const std::vector<std::string>& row, char separator) const;
  void read_row(std::string_view line);

  LineReader lines_;
  const std::string name_;
  MappedRows rows_;
  bool by_number_;  // all columns
  char separator_ = ',';
  std::vector<std::string> header_, units_, fields_;
  std::string previous_;   // line
  std::string first_row_;  // that was read to see that it is one
  std::size_t header_line_ = 0, units_line_ = 0;
  bool resolved_ = false;

  // The line that looked most like the header.
  bool first_line_is_own_ = false;
  std::size_t best_line_ = 1, best_found_ = 0, best_fields_ = 0;
  std::string refusal_;
};

}  // namespace backlash::record
