// SPDX-License-Identifier: BSD-3-Clause
#include "csv_decimal.h"

#include <algorithm>

#include "backlash_diagnosis/base/text.h"

namespace backlash::record {
namespace {

/// "1,234", "-12,345": three digits behind the comma, one to three before it that do not begin with 0.
bool may_be_thousands(std::string_view text, std::size_t comma) {
  const auto digits = [](std::string_view part) {
    return std::all_of(part.begin(), part.end(), [](char c) { return c >= '0' && c <= '9'; });
  };
  std::string_view before = text.substr(0, comma);
  const std::string_view after = text.substr(comma + 1);
  if (!before.empty() && (before.front() == '-' || before.front() == '+')) before.remove_prefix(1);
  return after.size() == 3 && digits(after) && !before.empty() && before.size() <= 3 && digits(before) &&
         before.front() != '0';
}

}  // namespace

std::string DecimalMark::with_point(std::string_view text, const std::string& column, const Place& where) {
  std::string plain(text);
  const auto place = text.find_first_of(comma_allowed_ ? ".," : ".");
  if (place == std::string_view::npos) return plain;
  const char mark = text[place];
  if (mark_ == '\0') {
    mark_ = mark;
    line_ = where.number();
    first_ = printable(column) + " = " + in_quotes(text);
  }
  if (mark != mark_)
    where.fail(printable(column) + " = " + in_quotes(text) + ": a decimal " +
               (mark == ',' ? "comma, but a point" : "point, but a comma") + " in " + where.text(line_));
  if (mark != ',') return plain;
  sure_ = sure_ || !may_be_thousands(text, place);
  plain[place] = '.';
  return plain;
}

void DecimalMark::finish(const Place& where) const {
  if (mark_ != ',' || sure_) return;
  where.fail_at(line_,
                first_ +
                    ": a decimal comma, or one between thousands? All numbers of the file with a comma "
                    "could be either; write them with a decimal point");
}

}  // namespace backlash::record
