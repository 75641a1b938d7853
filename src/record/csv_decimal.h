// SPDX-License-Identifier: BSD-3-Clause
// The decimal mark of a file: a point or, between semicolons or tabs, a comma, but one of them throughout.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "csv_lines.h"

namespace backlash::record {

class DecimalMark {
 public:
  /// Whether a comma may be a decimal mark: not where it separates fields.
  void allow_comma(bool allowed) { comma_allowed_ = allowed; }

  /// The text with a decimal point; BadData where the mark is another than before.
  std::string with_point(std::string_view text, const std::string& column, const Place& where);

  /// At the end of the file: BadData where all its commas could part thousands ("1,234").
  void finish(const Place& where) const;

 private:
  bool comma_allowed_ = false;
  char mark_ = '\0';  // the first there was
  std::size_t line_ = 0;
  std::string first_;  // as column = 'text'
  bool sure_ = false;  // no number with a comma is written so in thousands
};

}  // namespace backlash::record
